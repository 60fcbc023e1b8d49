"""Reads a dataset that `dlsd generate` made. Needs Python 3.8 and NumPy, nothing else.

    from dlsd_dataset import Dataset

    for image, lines, camera in Dataset("data", split="train"):
        print(image.shape, camera.model, [line.points for line in lines])

Images are decoded by OpenCV where it is installed, else here, which is slower.
Pixel coordinates: integers are pixel centres, (0, 0) is the centre of the top-left pixel.
Every field is explained in docs/dataset-format.md.

    python3 dlsd_dataset.py data        tells what is in a dataset
"""

import json
import os
import struct
import sys
import zlib

import numpy as np

SPLITS = ("train", "val", "test")
SHARES = (0.8, 0.1, 0.1)


def split_of(i, shares=SHARES):
    """The part that the i-th frame belongs to, as `dlsd export` parts datasets."""
    place = (i * 0x9E3779B97F4A7C15 % 2**64 >> 11) / 2**53
    if place < shares[0]:
        return "train"
    return "val" if place < shares[0] + shares[1] or shares[2] <= 0 else "test"


class Camera:
    """A calibrated camera: model ("kannala_brandt", ...), params (name -> value), width, height,
    max_field_angle (rad): docs/cameras.md. `file` is its calibration file, in Kalibr's form."""

    def __init__(self, folder, entry):
        self.name = entry["name"]
        self.model = entry["model"]
        self.params = dict(entry["params"])
        self.width = entry["width"]
        self.height = entry["height"]
        self.max_field_angle = entry["max_field_angle"]
        self.file = os.path.join(folder, "cameras", self.name + ".yaml")


class Line:
    """One label: points (n x 2, px, the exact image curve), points_in_cam (2 x 3, m), normal (3),
    id, edge, carrier, kind, ends, length_px, angle_rad, contrast, contrast_min."""

    def __init__(self, entry):
        self.__dict__.update(entry)
        for key in ("points", "points_in_cam", "normal"):
            setattr(self, key, np.array(entry[key], dtype=np.float64))


class Frame:
    """image, lines, camera = frame. Besides: index, name, record (all of the label file),
    cam_from_world (4 x 4) and plane(kind)."""

    def __init__(self, folder, entry, cameras):
        with open(os.path.join(folder, entry["labels"]), encoding="utf-8") as file:
            self.record = json.load(file)
        self.index = entry["index"]
        self.name = os.path.splitext(os.path.basename(entry["image"]))[0]
        self.image = read_png(os.path.join(folder, entry["image"]))
        self.lines = [Line(line) for line in self.record["lines"]]
        self.camera = cameras[self.record["camera"]]
        self.cam_from_world = np.array(self.record["cam_from_world"])
        self._planes = {
            plane["kind"]: os.path.join(folder, plane["file"]) for plane in entry.get("planes", [])
        }

    def plane(self, kind):
        """Per-pixel ground truth: "depth", "normal", ... Only where it was generated."""
        return np.load(self._planes[kind])

    def __iter__(self):
        return iter((self.image, self.lines, self.camera))


class Dataset:
    """The frames of a dataset folder, or those of one split: "train", "val" or "test". Frames are
    read when they are asked for. Works as a PyTorch map-style dataset, too."""

    def __init__(self, folder, split=None, shares=SHARES):
        if split is not None and split not in SPLITS:
            raise ValueError(f'split is "{split}", allowed are {", ".join(SPLITS)}')
        self.folder = folder
        with open(os.path.join(folder, "manifest.json"), encoding="utf-8") as file:
            self.manifest = json.load(file)
        if self.manifest["format"] != "dlsd-dataset/1":
            raise ValueError(f'{folder}: format is {self.manifest["format"]}, not dlsd-dataset/1')
        self.cameras = {
            f'cameras/{entry["name"]}.yaml': Camera(folder, entry)
            for entry in self.manifest["config"]["cameras"]
        }
        self._frames = [
            entry
            for i, entry in enumerate(self.manifest["frames"])
            if split is None or split_of(i, shares) == split
        ]

    def __len__(self):
        return len(self._frames)

    def __getitem__(self, i):
        return Frame(self.folder, self._frames[i], self.cameras)

    def __iter__(self):
        return (self[i] for i in range(len(self)))


def read_png(path):
    """height x width (x channels) array of uint8 or uint16."""
    try:
        import cv2

        image = cv2.imread(path, cv2.IMREAD_UNCHANGED)
        if image is None:
            raise ValueError(f"{path}: cannot be read")
        if image.ndim == 3:
            image[..., :3] = image[..., 2::-1].copy()
        return image
    except ImportError:
        pass
    with open(path, "rb") as file:
        return decode_png(file.read(), path)


def decode_png(data, path="png"):
    """PNG (ISO 15948) of 8 or 16 bit, grey or colour, not interlaced and without a palette."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path}: not a PNG file")
    at, packed, header, kind = 8, b"", None, b""
    while kind != b"IEND":
        if at + 12 > len(data):
            raise ValueError(f"{path}: truncated")
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body, checksum = data[at + 8 : at + 8 + length], data[at + 8 + length : at + 12 + length]
        if checksum != struct.pack(">I", zlib.crc32(kind + body)):
            raise ValueError(f"{path}: damaged")
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, bits, colour, _, _, interlaced = header
    channels = {0: 1, 2: 3, 4: 2, 6: 4}.get(colour)
    if channels is None or bits not in (8, 16) or interlaced:
        raise ValueError(f"{path}: a kind of PNG that is not read here")
    step = channels * bits // 8
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * step)
    pixels = _unfilter(rows[:, 0], rows[:, 1:].reshape(height, width, step))
    image = pixels.reshape(height, width, channels, bits // 8)
    if bits == 16:
        image = image.view(">u2").astype(np.uint16)
    image = image.reshape(height, width, channels)
    return image[..., 0] if channels == 1 else image


def _unfilter(filters, raw):
    """Adds to each byte what its row's filter predicts from the left, upper and upper left pixel.
    Those are of the two diagonals x + y before, so that a diagonal is done at once."""
    height, width, step = raw.shape
    out = np.zeros((height + 1, width + 1, step), np.int16)  # With a row and column of zeros.
    for s in range(height + width - 1):
        y = np.arange(max(0, s - width + 1), min(height, s + 1))
        x = s - y
        left, up, corner = out[y + 1, x], out[y, x + 1], out[y, x]
        to_left, to_up = abs(up - corner), abs(left - corner)
        to_corner = abs(left + up - 2 * corner)
        paeth = np.where(
            (to_left <= to_up) & (to_left <= to_corner), left, np.where(to_up <= to_corner, up, corner)
        )
        kind = filters[y][:, None]
        guess = np.choose(kind, [np.int16(0), left, up, (left + up) // 2, paeth])
        out[y + 1, x + 1] = (raw[y, x] + guess) & 255
    return np.ascontiguousarray(out[1:, 1:]).astype(np.uint8)


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    for split in SPLITS:
        frames = Dataset(sys.argv[1], split)
        lines = [len(frame.lines) for frame in frames]
        print(f"{split}: {len(frames)} frames, {sum(lines)} lines")


if __name__ == "__main__":
    main()
