"""Datasets for the Python tests, written from docs/dataset-format.md: by hand, or by the program."""

import hashlib
import json
import os
import struct
import subprocess
import zlib

import numpy as np

DLSD = os.environ["DLSD_BINARY"]

PINHOLE = ("pinhole", "none", "[{fx}, {fx}, {cx}, {cy}]", "[]")


def run(*arguments, cwd=None, code=0):
    done = subprocess.run([DLSD, *map(str, arguments)], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == code, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done


def camera_yaml(model, distortion, intrinsics, coefficients, width, height):
    return (
        f"cam0:\n  camera_model: {model}\n  distortion_model: {distortion}\n"
        f"  intrinsics: {intrinsics}\n  distortion_coeffs: {coefficients}\n"
        f"  resolution: [{width}, {height}]\n"
    )


def png(image):
    """Grey or RGB, 8 or 16 bit; the filter of row y is y mod 5."""
    image = image if image.ndim == 3 else image[..., None]
    height, width, channels = image.shape
    bits = 8 * image.dtype.itemsize
    raw = image.astype(image.dtype.newbyteorder(">")).tobytes()
    step, pitch = channels * bits // 8, channels * bits // 8 * width
    rows, before = b"", bytes(pitch)
    for y in range(height):
        row = raw[y * pitch : (y + 1) * pitch]
        out = bytearray()
        for i, value in enumerate(row):
            a = row[i - step] if i >= step else 0
            b, c = before[i], before[i - step] if i >= step else 0
            p = a + b - c
            nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            out.append((value - (0, a, b, (a + b) // 2, nearest)[y % 5]) & 255)
        rows += bytes([y % 5]) + bytes(out)
        before = row

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, bits, 0 if channels == 1 else 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )


def line(identity, points, ray=lambda u, v: (u, v, 100.0)):
    """A label along pixels. `ray` says where they look."""
    ends = [np.array(ray(*points[0]), float), np.array(ray(*points[-1]), float)]
    normal = np.cross(*ends)
    length = sum(np.hypot(*np.subtract(a, b)) for a, b in zip(points, points[1:]))
    return {
        "id": identity,
        "edge": 0,
        "carrier": 0,
        "kind": "crease",
        "points_in_cam": [list(end) for end in ends],
        "normal": list(normal / np.linalg.norm(normal)),
        "points": [list(p) for p in points],
        "ends": ["vertex", "vertex"],
        "length_px": length,
        "angle_rad": 0.1,
        "contrast": 50,
        "contrast_min": 20,
    }


def write_dataset(folder, camera, image_and_lines):
    """`camera`: text of a calibration file. One frame for each (image, lines)."""

    def put(name, content):
        path = os.path.join(folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)
        return hashlib.sha256(content).hexdigest()

    manifest = {
        "format": "dlsd-dataset/1",
        "generator": "test",
        "config": {"count": len(image_and_lines)},
        "cameras": [{"file": "cameras/c.yaml", "sha256": put("cameras/c.yaml", camera.encode())}],
        "frames": [],
    }
    for i, (image, lines) in enumerate(image_and_lines):
        record = {
            "format": "dlsd-labels/1",
            "image": f"images/{i:06}.png",
            "camera": "cameras/c.yaml",
            "width": image.shape[1],
            "height": image.shape[0],
            "seed": 1,
            "index": i,
            "cam_from_world": np.eye(4).tolist(),
            "sensor": {},
            "lines": lines,
            "junctions": [],
        }
        manifest["frames"].append(
            {
                "index": i,
                "image": record["image"],
                "image_sha256": put(record["image"], png(image)),
                "labels": f"labels/{i:06}.json",
                "labels_sha256": put(f"labels/{i:06}.json", json.dumps(record).encode()),
            }
        )
    put("manifest.json", json.dumps(manifest).encode())
