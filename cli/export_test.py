"""Reads what `dlsd export` writes as the programs do that it is meant for, with their libraries
(json, NumPy, h5py, tarfile), and compares it with the labels of the dataset. Knows nothing of how
the exports are made; formulas are the formats' and the cameras' own."""

import contextlib
import glob
import hashlib
import io
import json
import os
import re
import shutil
import signal
import subprocess
import tarfile
import tempfile
import time
import unittest

import dataset_maker
import numpy as np
from dataset_maker import DLSD, camera_yaml, line, run, write_dataset

try:
    import h5py
except ImportError:
    h5py = None

FRAMES = 14
KB = dict(fx=62.0, fy=61.0, cx=79.0, cy=60.5, d=(0.02, -0.01, 0.004, -0.001))
CAMERAS = {
    # Looks farther than 90 degrees in the corners.
    "kb": camera_yaml(
        "pinhole", "equidistant", "[62.0, 61.0, 79.0, 60.5]", "[0.02, -0.01, 0.004, -0.001]", 160, 120
    ),
    "straight": camera_yaml("pinhole", "none", "[80.0, 80.0, 79.5, 59.5]", "[]", 160, 120),
    "fov": camera_yaml("pinhole", "fov", "[56.0, 56.0, 79.5, 59.5]", "[0.93]", 160, 120),
}
NAMES = list(CAMERAS)


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


@contextlib.contextmanager
def arrays(path):
    """All arrays of an .npz, unpacked once."""
    with np.load(path) as npz:
        yield dict(npz)


def tree(folder):
    digests = {}
    for root, _, files in os.walk(folder):
        for name in files:
            with open(os.path.join(root, name), "rb") as file:
                path = os.path.relpath(os.path.join(root, name), folder)
                digests[path] = hashlib.sha256(file.read()).hexdigest()
    return digests


class Curves:
    """The straight pieces of polylines, for distances of many points at once."""

    def __init__(self, curves):
        self.a = np.concatenate([c[:-1] for c in curves])
        self.d = np.concatenate([np.diff(c, axis=0) for c in curves])
        self.length2 = np.maximum(np.sum(self.d**2, axis=1), 1e-30)

    def nearest(self, p):
        """The shares of all pieces at which they are nearest to points, and the distances."""
        p = np.asarray(p, float)
        x, y = p[..., 0, None] - self.a[:, 0], p[..., 1, None] - self.a[:, 1]
        dx, dy = self.d.T
        t = np.minimum(np.maximum((x * dx + y * dy) / self.length2, 0), 1)
        return t, np.hypot(x - t * dx, y - t * dy)

    def distances(self, p):
        """Of a point to all pieces, and the nearest points."""
        t, distances = self.nearest(p)
        return distances, self.a + t[:, None] * self.d

    def distance(self, p):
        """Of points to the nearest piece."""
        return self.nearest(p)[1].min(axis=-1)


def distance_to_curve(p, curve):
    return Curves([curve]).distance(p)


def at_share(curve, share):
    """The points of a polyline at shares of its length."""
    steps = np.hypot(*np.diff(curve, axis=0).T)
    length = np.concatenate([[0], np.cumsum(steps)])
    return np.stack([np.interp(np.multiply(share, length[-1]), length, curve[:, k]) for k in (0, 1)], -1)


def kb_radius(D, theta):
    return theta * (1 + sum(k * theta ** (2 * i + 2) for i, k in enumerate(D)))


def kb_project(K, D, rays):
    x, y, z = np.moveaxis(rays, -1, 0)
    radius = kb_radius(D, np.arctan2(np.hypot(x, y), z))
    phi = np.arctan2(y, x)
    return np.stack(
        [K[0][0] * radius * np.cos(phi) + K[0][2], K[1][1] * radius * np.sin(phi) + K[1][2]], -1
    )


def kb_unproject(K, D, p):
    x, y = (p[..., 0] - K[0][2]) / K[0][0], (p[..., 1] - K[1][2]) / K[1][1]
    radius = np.hypot(x, y)
    lo, hi = np.zeros_like(radius), np.full_like(radius, np.pi / 2)
    for _ in range(60):
        theta = (lo + hi) / 2
        short = kb_radius(D, theta) < radius
        lo, hi = np.where(short, theta, lo), np.where(short, hi, theta)
    phi = np.arctan2(y, x)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def great_circle(a, b, n):
    angle = np.arccos(np.clip(a @ b, -1, 1))
    t = np.linspace(0, 1, n)[:, None]
    return (np.sin((1 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)


class Export(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="dlsd-export-test-")
        arguments = []
        for name, text in CAMERAS.items():
            with open(os.path.join(cls.folder, name + ".yaml"), "w", encoding="utf-8") as file:
                file.write(text)
            arguments += ["--camera", name + ".yaml"]
        run("generate", *arguments, "--count", FRAMES, "--seed", 4, "--out", "data", cwd=cls.folder)
        cls.labels = [load(f"{cls.folder}/data/labels/{i:06}.json") for i in range(FRAMES)]
        cls.exported = set()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def export(self, name, *more, data="data", out=None):
        out = out or "-".join([name, data, *map(str, more)]).replace("/", "")
        if out not in self.exported:
            run("export", "--format", name, "--data", data, "--out", out, *more, cwd=self.folder)
            self.exported.add(out)
            self.assertFalse(os.path.exists(f"{self.folder}/{out}.partial"))
        return os.path.join(self.folder, out)

    def lines_of(self, stem):
        """Curves of a frame, (0, 0) in the image's corner."""
        return [np.array(l["points"]) + 0.5 for l in self.labels[int(stem)]["lines"]]


def part(i):
    """The rule of docs/dataset-format.md."""
    place = i * 0.6180339887498949 % 1
    return "train" if place < 0.8 else "val" if place < 0.9 else "test"


SPLIT = {name: [i for i in range(FRAMES) if part(i) == name] for name in ("train", "val", "test")}
assert all(SPLIT.values())


class Ulsd(Export):
    def test_raw(self):
        raw = self.export("ulsd") + "/dataset/dlsd_raw"
        checked = cut = 0
        for split, frames in SPLIT.items():
            entries = load(f"{raw}/{split}.json")
            self.assertEqual([e["filename"] for e in entries], [f"{i:06}.png" for i in frames])
            for entry in entries:
                self.assertRegex(entry["filename"], r"^[^. ]+\.png$")
                i = int(entry["filename"].split(".")[0])
                with open(f"{raw}/image/{entry['filename']}", "rb") as a:
                    with open(f"{self.folder}/data/images/{i:06}.png", "rb") as b:
                        self.assertEqual(a.read(), b.read())
                lines = np.array(entry["lines"])
                self.assertGreater(len(lines), 0)
                self.assertEqual(lines.shape[1:], (2, 2))
                curves = self.lines_of(i)
                camera = NAMES[i % 3]
                if camera == "straight":
                    self.assertEqual(entry["type"], "pinhole")
                    self.assertNotIn("K", entry)
                    self.assertEqual(len(lines), len(curves))
                    for (a, b), curve in zip(lines, curves):
                        np.testing.assert_allclose([a, b], curve[[0, -1]], atol=1e-9)
                    continue
                self.assertEqual(entry["type"], "fisheye")
                K, D = entry["K"], entry["D"]
                self.assertEqual(len(D), 4)
                if camera == "kb":
                    np.testing.assert_allclose(K, [[62, 0, 79.5], [0, 61, 61], [0, 0, 1]], rtol=1e-12)
                    np.testing.assert_allclose(D, KB["d"], rtol=1e-12)
                curves = [Curves([c]) for c in curves]
                # Their program makes the curve again of end points, K and D.
                rays = kb_unproject(K, D, lines)
                self.assertLess(np.arccos(rays[..., 2]).max(), np.pi / 2)
                np.testing.assert_allclose(kb_project(K, D, rays), lines, atol=1e-6)
                k = 0
                for ends, end_rays in zip(lines, rays):
                    if np.linalg.norm(ends[0] - ends[1]) < 1:
                        continue
                    # In the order of the labels, which give none, one or two lines.
                    while curves[k].distance(ends).max() > 0.02:
                        k += 1
                    far = curves[k].distance(kb_project(K, D, great_circle(*end_rays, 9))).max()
                    self.assertLess(far, 0.02 if camera == "kb" else 0.15)
                    checked += 1
                cut += len(lines) != len(curves)
        self.assertGreater(checked, 300)

    def check_maps(self, npz, mask, offset, points):
        """The cells of points, and where in them the points are."""
        cells, cell_of = np.unique(points[:, ::-1].astype(int), axis=0, return_inverse=True)
        self.assertEqual(npz[mask].shape, (1, 128, 128))
        self.assertEqual(npz[offset].shape, (2, 128, 128))
        np.testing.assert_array_equal(np.argwhere(npz[mask][0] != 0), cells)
        self.assertTrue(np.all(np.isin(npz[mask], [0, 1])))
        stored = npz[offset][:, cells[:, 0], cells[:, 1]].T
        np.testing.assert_array_less(abs(stored), 0.5 + 1e-6)
        off = abs(points - (cells[:, ::-1] + 0.5 + stored)[cell_of]).max(axis=1)
        nearest = np.full(len(cells), np.inf)
        np.minimum.at(nearest, cell_of, off)
        np.testing.assert_array_less(nearest, 2e-5 + 1e-5)
        self.assertTrue(np.all(npz[offset][:, npz[mask][0] == 0] == 0))

    def check_npz(self, npz, stem, order, flip):
        scale = np.array([128 / 160, 128 / 120])

        def moved(curve):
            curve = curve * scale
            if flip & 1:
                curve = [128, 0] + curve * [-1, 1]
            if flip & 2:
                curve = [0, 128] + curve * [1, -1]
            return curve

        originals = self.lines_of(stem)
        curves = [moved(c) for c in originals]
        lpos = npz["lpos"]
        self.assertEqual(lpos.shape, (len(curves), order + 1, 2))
        self.assertEqual(npz["lneg"].size, 0)
        self.assertTrue(np.all(lpos[:, 0, 1] <= lpos[:, -1, 1]))
        shares = np.arange(order + 1) / order
        exact = moved(np.array([at_share(original, shares) for original in originals]))
        exact = np.clip(exact, 0, 128 - 1e-5)
        is_back = exact[:, 0, 1] > exact[:, -1, 1] + 1e-4
        is_back |= np.isclose(lpos[:, 0], exact[:, -1], atol=1e-4).all(axis=1)
        exact[is_back] = exact[is_back, ::-1]
        np.testing.assert_allclose(lpos, exact, atol=1e-4)
        ends = np.concatenate([lpos[:, 0], lpos[:, -1]]).astype(float)
        junc = npz["junc"]
        rounded = {(round(x * 1000), round(y * 1000)) for x, y in junc}
        self.assertEqual(len(rounded), len(junc))
        np.testing.assert_allclose(junc, np.round(junc, 3), atol=1e-5)
        apart = np.hypot(ends[:, 0, None] - junc[:, 0], ends[:, 1, None] - junc[:, 1])
        np.testing.assert_array_less(apart.min(axis=1), 1.5e-3)
        np.testing.assert_array_less(apart.min(axis=0), 1.5e-3)
        self.check_maps(npz, "jmap", "joff", junc)
        middles = np.array([np.clip(moved(at_share(c, 0.5)), 0, 128 - 1e-5) for c in originals])
        cells = {(int(y), int(x)) for x, y in middles}
        # A middle within rounding of a cell's border may be in either.
        found = {tuple(c) for c in np.argwhere(npz["cmap"][0] != 0)}
        clear = {
            (int(y), int(x)) for x, y in middles if min(x % 1, 1 - x % 1, y % 1, 1 - y % 1) > 1e-4
        }
        self.assertLessEqual(clear, found)
        self.assertLessEqual(len(found), len(cells) + 2)
        channels = 4 * ((order + 1) // 2)
        self.assertEqual(npz["eoff"].shape, (channels, 128, 128))
        np.testing.assert_array_equal(npz["eoff"], npz["lvec"])
        for y, x in clear:
            centre = npz["coff"][:, y, x] + 0.5 + (x, y)
            stored = npz["eoff"][:, y, x].reshape(-1, 2) + centre
            rest = np.delete(lpos, order // 2, axis=1) if order % 2 == 0 else lpos
            off = abs(middles - centre).max(axis=1)
            near = np.flatnonzero(off < 4e-4)
            self.assertGreater(len(near), 0)
            misfit = abs(stored - rest[near]).max(axis=(1, 2)) + off[near]
            self.assertLess(misfit.min(), 4e-4)
        lmap = npz["lmap"]
        self.assertEqual(lmap.shape, (1, 128, 128))
        self.assertTrue(np.all((lmap >= 0) & (lmap <= 1)))
        rng = np.random.default_rng(1)
        pieces = Curves(curves)
        y, x = rng.integers(0, 128, (150, 2)).T
        near = pieces.distance(np.stack([x + 0.5, y + 0.5], -1))
        np.testing.assert_allclose(lmap[0, y, x], np.maximum(0, 1 - near), rtol=0, atol=5e-5)

    def test_npz(self):
        for order in (1, 2, 3, 4):
            out = self.export("ulsd", "--order", order, "--name", "a-b")
            for split, frames in SPLIT.items():
                folder = f"{out}/dataset/a-b_{order}/{split}"
                flips = ["_0", "_1", "_2", "_3"] if split == "train" else [""]
                expected = [f"{i:06}{f}" for i in frames for f in flips]
                # Paired by sorted names.
                for kind in ("png", "npz"):
                    found = sorted(os.path.basename(p) for p in glob.glob(f"{folder}/*.{kind}"))
                    self.assertEqual(found, [f"{e}.{kind}" for e in expected])
                for i in frames[: 3 if order == 2 else 1]:
                    for f, suffix in enumerate(flips):
                        with arrays(f"{folder}/{i:06}{suffix}.npz") as npz:
                            for key in ("jmap", "joff", "cmap", "coff", "eoff", "lmap"):
                                self.assertEqual(npz[key].dtype, np.float32)
                            self.check_npz(npz, i, order, f)

    def test_truth(self):
        folder = self.export("ulsd") + "/dataset/dlsd"
        names = sorted(os.path.basename(p) for p in glob.glob(folder + "/*"))
        self.assertEqual(names, [f"{i:06}.{k}" for i in SPLIT["test"] for k in ("npz", "png")])
        for i in SPLIT["test"]:
            with arrays(f"{folder}/{i:06}.npz") as npz:
                curves = [c * [128 / 160, 128 / 120] for c in self.lines_of(i)]
                self.assertEqual(npz["line"].shape, (len(curves), 7, 2))
                self.assertEqual(npz["junc"].shape[1], 2)
                for points, curve in zip(npz["line"], curves):
                    self.assertLess(distance_to_curve(points, curve).max(), 1e-3)
                    steps = np.hypot(*np.diff(points / [128 / 160, 128 / 120], axis=0).T)
                    self.assertLess(np.ptp(steps), 0.02 * steps.max() + 1e-3)


class Lcnn(Export):
    def test_raw(self):
        raw = self.export("lcnn") + "/raw"
        for split, name in (("train", "train"), ("val", "valid"), ("test", "test")):
            entries = load(f"{raw}/{name}.json")
            self.assertEqual([e["filename"] for e in entries], [f"{i:06}.png" for i in SPLIT[split]])
            for entry in entries:
                self.assertTrue(os.path.exists(f"{raw}/images/{entry['filename']}"))
                curves = self.lines_of(entry["filename"][:-4])
                chords = [[*c[0], *c[-1]] for c in curves]
                np.testing.assert_allclose(entry["lines"], chords, atol=1e-9)

    def test_npz(self):
        out = self.export("lcnn")
        for split, name in (("train", "train"), ("val", "valid"), ("test", "test")):
            files = sorted(glob.glob(f"{out}/{name}/*_label.npz"))
            flips = 4 if split == "train" else 1
            self.assertEqual(
                [os.path.basename(f) for f in files],
                [f"{i:06}_{f}_label.npz" for i in SPLIT[split] for f in range(flips)],
            )
            for path in files:
                image = path[:-10] + ".png"  # As their loader finds it.
                self.assertTrue(os.path.exists(image))
                flip = int(path[-11])
                with arrays(path) as npz:
                    self.check(npz, self.lines_of(os.path.basename(path)[:6]), flip)

    def check(self, npz, curves, flip):
        junc, lpos, lneg = npz["junc"], npz["lpos"], npz["lneg"]
        self.assertEqual(npz["jmap"].shape, (1, 128, 128))
        self.assertEqual(npz["joff"].shape, (1, 2, 128, 128))
        self.assertEqual(npz["lmap"].shape, (128, 128))
        self.assertEqual((junc.shape[1:], lpos.shape[1:], lneg.shape[1:]), ((3,), (2, 3), (2, 3)))
        self.assertAlmostEqual(float(npz["aspect_ratio"]), 160 / 120, places=6)
        for key in ("Lpos", "Lneg"):
            self.assertTrue(np.issubdtype(npz[key].dtype, np.integer))
        self.assertTrue(np.all(junc[:, 2] == 0))
        self.assertTrue(0 < len(lneg) <= 2000 and len(npz["Lneg"]) <= 4000)
        np.testing.assert_array_equal(junc[npz["Lpos"]], lpos)
        np.testing.assert_array_equal(junc[npz["Lneg"]][: len(lneg)], lneg)
        positive = {tuple(sorted(p)) for p in npz["Lpos"]}
        self.assertFalse(positive & {tuple(sorted(p)) for p in npz["Lneg"]})
        self.assertEqual(len(positive), len(npz["Lpos"]))
        # As their loader restores junctions: (y, x) of a cell, plus its offset, plus one half.
        cells = np.argwhere(npz["jmap"][0] > 0)
        self.assertEqual({(int(y), int(x)) for y, x, _ in junc}, {tuple(c) for c in cells})
        restored = cells + npz["joff"][0][:, cells[:, 0], cells[:, 1]].T + 0.5
        apart = np.hypot(restored[:, 0, None] - junc[:, 0], restored[:, 1, None] - junc[:, 1])
        np.testing.assert_array_less(apart.min(axis=1), 1e-4)
        # Chords of labels and positive lines are the same, (y, x) here.
        ends = []
        for curve in curves:
            pair = curve[[0, -1]] * [128 / 160, 128 / 120]
            pair = np.abs([128 * (flip & 1), 128 * (flip >> 1)] - pair)
            ends.append(np.clip(pair[:, ::-1], 0, 128 - 1e-3))

        ends = np.array(ends)
        positives = lpos[:, :, :2].astype(float)

        def farthest(segments, others):
            """The largest distance of a segment from the nearest other one, either way round."""

            def apart(b):
                return np.maximum.reduce(
                    [abs(segments[:, i, j, None] - b[:, i, j]) for i in (0, 1) for j in (0, 1)]
                ).min(axis=1)

            return np.minimum(apart(others), apart(others[:, ::-1])).max()

        self.assertLess(farthest(positives, ends), 2e-3)
        long = np.hypot(*(ends[:, 0] - ends[:, 1]).T) > 2e-3
        self.assertLess(farthest(ends[long], positives), 2e-3)
        chords = [s[:, ::-1].astype(float) for s in lpos[:, :, :2]]
        rng = np.random.default_rng(2)
        pieces = Curves(chords)
        y, x = rng.integers(0, 128, (60, 2)).T
        near = pieces.distance(np.stack([x + 0.5, y + 0.5], -1))
        np.testing.assert_allclose(npz["lmap"][y, x], np.maximum(0, 1 - near), rtol=0, atol=5e-5)
        # Hard examples first.
        steps = np.linspace(0, 1, 50)[:, None]
        a, b = lneg[:, 0, None, :2], lneg[:, 1, None, :2]
        p = (a + (b - a) * steps).astype(int)
        score = npz["lmap"][p[..., 0], p[..., 1]].mean(axis=1)
        tenth = max(1, len(score) // 10)
        self.assertGreaterEqual(np.mean(score[:tenth]), np.mean(score[-tenth:]))


class CocoLine(Export):
    def test_annotations(self):
        out = self.export("coco-line")
        seen_images, seen_annotations = set(), set()
        for split, frames in SPLIT.items():
            coco = load(f"{out}/annotations/lines_{split}2017.json")
            self.assertEqual(
                coco["categories"], [{"supercategory": "line", "id": "0", "name": "line"}]
            )
            names = sorted(os.listdir(f"{out}/{split}2017"))
            self.assertEqual([i["file_name"] for i in coco["images"]], names)
            self.assertEqual(names, [f"{i:06}.png" for i in frames])
            by_image = {image["id"]: [] for image in coco["images"]}
            self.assertFalse(seen_images & set(by_image))
            seen_images |= set(by_image)
            for annotation in coco["annotations"]:
                self.assertGreater(annotation["id"], 0)
                self.assertNotIn(annotation["id"], seen_annotations)
                seen_annotations.add(annotation["id"])
                by_image[annotation["image_id"]].append(annotation)
            for image in coco["images"]:
                self.assertEqual((image["width"], image["height"]), (160, 120))
                labels = self.labels[int(image["file_name"][:6])]["lines"]
                self.assertEqual(len(by_image[image["id"]]), len(labels))
                for annotation, label in zip(by_image[image["id"]], labels):
                    self.assertEqual((annotation["category_id"], annotation["area"]), (0, 1))
                    self.assertNotIn("bbox", annotation)
                    self.assertEqual(annotation["label"], label["id"])
                    self.assertEqual(annotation["kind"], label["kind"])
                    curve = np.array(label["points"]) + 0.5
                    np.testing.assert_allclose(
                        np.reshape(annotation["polyline"], (-1, 2)), curve, atol=1e-9
                    )
                    x, y, dx, dy = annotation["line"]
                    self.assertTrue(dx > 0 or (dx == 0 and dy >= 0))
                    ends = sorted(map(tuple, curve[[0, -1]]))
                    np.testing.assert_allclose([(x, y), (x + dx, y + dy)], ends, atol=1e-9)
        self.assertEqual(len(seen_images), FRAMES)


@unittest.skipIf(h5py is None, "h5py is not installed")
class DeepLsd(Export):
    def check(self, out, split, name, lines, shape):
        height, width = shape
        with h5py.File(f"{out}/gt/{split}/{name}.hdf5", "r") as file:
            # As their loader does.
            df = np.array(file["df"]).reshape(height, width)
            level = np.array(file["line_level"]).reshape(height, width)
            closest = np.array(file["closest"]).reshape(height, width, 2)
            background = np.array(file["bg_mask"]).reshape(height, width)
        self.assertTrue(np.all((level >= 0) & (level < np.pi)))
        self.assertTrue(np.all(np.isin(background, [0, 1])))
        rng = np.random.default_rng(3)
        pieces = Curves(lines)
        for y, x in zip(rng.integers(0, height, 200), rng.integers(0, width, 200)):
            p = np.array([x, y], float)
            distances, points = pieces.distances(p)
            nearest = distances.argmin()
            self.assertAlmostEqual(df[y, x], distances[nearest], places=3)
            far = float(np.hypot(*(closest[y, x] - p)))
            self.assertAlmostEqual(far, distances[nearest], places=3)
            rivals = np.flatnonzero(distances < distances[nearest] + 1e-3)
            angles = np.arctan2(pieces.d[rivals, 1], pieces.d[rivals, 0]) - level[y, x]
            self.assertLess(abs(np.sin(angles)).min(), 1e-3)
            self.assertLess(np.hypot(*(closest[y, x] - points[rivals]).T).min(), 2e-3)
        # Dilation by a square of 21 px, by the greatest distance in x or y of pixels on lines.
        on = np.zeros((height, width), bool)
        for curve in lines:
            for a, b in zip(curve, curve[1:]):
                t = np.linspace(0, 1, 2 + int(8 * np.hypot(*(b - a))))[:, None]
                u, v = np.floor(a + t * (b - a) + 0.5).astype(int).T
                on[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)] = True
        vs, us = np.nonzero(on)
        wrong = 0
        for y, x in zip(rng.integers(0, height, 300), rng.integers(0, width, 300)):
            far = np.maximum(abs(vs - y), abs(us - x)).min()
            wrong += (far > 10) != (background[y, x] == 1)
        self.assertLessEqual(wrong, 2)  # A curve that cuts the corner of a pixel.

    def test_fields(self):
        out = self.export("deeplsd")
        for split, frames in SPLIT.items():
            images = sorted(os.listdir(f"{out}/images/{split}"))
            truth = sorted(os.listdir(f"{out}/gt/{split}"))
            self.assertEqual([n[:6] for n in images], [n[:6] for n in truth])
            self.assertEqual(images, [f"{i:06}.png" for i in frames])
            for i in frames:
                lines = [c - 0.5 for c in self.lines_of(i)]
                self.check(out, split, f"{i:06}", lines, (120, 160))


class WebDataset(Export):
    def samples(self, out, split):
        """Members by the part of their path before the first dot: adjacent ones make a sample."""
        keys, samples = [], []
        for shard in sorted(glob.glob(f"{out}/{split}-*.tar")):
            with tarfile.open(shard) as tar:
                for member in tar:
                    self.assertEqual((member.mtime, member.uid, member.type), (0, 0, tarfile.REGTYPE))
                    key, suffix = member.name.split(".", 1)
                    if not keys or keys[-1] != key:
                        self.assertNotIn(key, keys)
                        keys.append(key)
                        samples.append({})
                    samples[-1][suffix] = tar.extractfile(member).read()
        return keys, samples

    def test_tar(self):
        out = self.export("webdataset")
        for split, frames in SPLIT.items():
            keys, samples = self.samples(out, split)
            self.assertEqual(keys, [f"{i:06}" for i in frames])
            for i, sample in zip(frames, samples):
                self.assertEqual(set(sample), {"json", "png"})
                with open(f"{self.folder}/data/images/{i:06}.png", "rb") as file:
                    self.assertEqual(sample["png"], file.read())
                record = json.loads(sample["json"])
                calibration = record.pop("calibration")
                self.assertEqual(record, self.labels[i])
                if NAMES[i % 3] == "fov":
                    self.assertEqual(calibration["model"], "fov")
                    self.assertEqual(calibration["params"]["omega"], 0.93)

    def test_planes(self):
        run("generate", "--camera", "fov.yaml", "--count", 2, "--planes", "depth,df", "--out", "planes",
            cwd=self.folder)  # fmt: skip
        out = self.export("webdataset", "--split", "1,0,0", data="planes")
        keys, samples = self.samples(out, "train")
        self.assertEqual(keys, ["000000", "000001"])
        for key, sample in zip(keys, samples):
            self.assertEqual(set(sample), {"json", "png", "depth.npy", "df.npy"})
            for kind, shape in (("depth", (120, 160)), ("df", (120, 160, 4))):
                with open(f"{self.folder}/planes/planes/{kind}/{key}.npy", "rb") as file:
                    self.assertEqual(sample[kind + ".npy"], file.read())
                plane = np.load(io.BytesIO(sample[kind + ".npy"]))
                self.assertEqual((plane.shape, plane.dtype), (shape, np.float32))

    def test_shards(self):
        out = self.export("webdataset", "--shard-size", 1, "--split", "1,0,0", data="data")
        self.assertFalse(glob.glob(out + "/val*") + glob.glob(out + "/test*"))
        self.assertEqual(self.samples(out, "train")[0], [f"{i:06}" for i in range(FRAMES)])
        # Bigger frames fill several shards.
        noise = np.random.default_rng(4).integers(0, 256, (600, 700), dtype=np.uint8)
        camera = camera_yaml("pinhole", "none", "[500.0, 500.0, 350.0, 300.0]", "[]", 700, 600)
        write_dataset(self.folder + "/big", camera, [(noise, [line(0, [(9, 9), (99, 99)])])] * 6)
        out = self.export("webdataset", "--shard-size", 1, "--split", "1,0,0", data="big")
        self.assertEqual(len(glob.glob(out + "/train-*.tar")), 2)
        self.assertEqual(len(self.samples(out, "train")[0]), 6)


class Traps(Export):
    """Data that has broken such programs."""

    def hand_made(self, name, width, height, frames):
        camera = camera_yaml(
            "pinhole", "none", f"[100.0, 100.0, {(width - 1) / 2}, {(height - 1) / 2}]", "[]", width, height
        )
        write_dataset(f"{self.folder}/{name}", camera, frames)

    def test_frames_without_lines(self):
        image = np.full((64, 64), 9, np.uint8)
        lines = [line(7, [(5, 5), (50, 9)]), line(3, [(5, 5), (9, 40)])]
        self.hand_made("gaps", 64, 64, [(image, []), (image, lines), (image, []), (image, lines)])
        kept = ["000001", "000003"]
        everything = ("--split", "1,0,0")
        out = self.export("ulsd", *everything, data="gaps")
        self.assertEqual(
            [e["filename"][:6] for e in load(f"{out}/dataset/dlsd_raw/train.json")], kept
        )
        self.assertEqual(load(f"{out}/dataset/dlsd_raw/test.json"), [])
        self.assertEqual(len(os.listdir(f"{out}/dataset/dlsd_2/train")), 2 * 4 * 2)
        self.assertEqual(sorted(os.listdir(f"{out}/dataset/dlsd_raw/image")), [k + ".png" for k in kept])
        out = self.export("lcnn", *everything, data="gaps")
        self.assertEqual([e["filename"][:6] for e in load(f"{out}/raw/train.json")], kept)
        out = self.export("deeplsd", *everything, data="gaps")
        self.assertEqual(sorted(os.listdir(f"{out}/gt/train")), [k + ".hdf5" for k in kept])
        coco = load(self.export("coco-line", *everything, data="gaps") + "/annotations/lines_train2017.json")
        self.assertEqual(len(coco["images"]), 4)
        self.assertEqual([a["label"] for a in coco["annotations"]], [7, 3, 7, 3])
        with tarfile.open(self.export("webdataset", *everything, data="gaps") + "/train-000000.tar") as tar:
            self.assertEqual(len(tar.getnames()), 8)
        # Nothing but empty frames.
        self.hand_made("nothing", 64, 64, [(image, [])])
        for name in ("ulsd", "lcnn", "coco-line", "deeplsd", "webdataset"):
            self.export(name, data="nothing")

    def test_lcnn_needs_junctions_that_are_not_joined(self):
        image = np.zeros((64, 64), np.uint8)
        one = [line(0, [(5, 5), (50, 9)])]
        corners = [(5.0, 5.0), (50.0, 9.0), (20.0, 44.0)]
        triangle = [line(i, [corners[i], corners[(i + 1) % 3]]) for i in range(3)]
        self.hand_made("few", 64, 64, [(image, one), (image, triangle), (image, triangle[:2])])
        out = self.export("lcnn", "--split", "1,0,0", data="few")
        self.assertEqual([e["filename"] for e in load(f"{out}/raw/train.json")], ["000002.png"])

    def test_lines_to_the_border_stay_in_the_heat_map(self):
        image = np.zeros((48, 64), np.uint8)
        lines = [
            line(0, [(-0.5, -0.5), (63.5, 47.5)]),
            line(1, [(63.5, -0.5), (63.5, 47.5)]),
            line(2, [(-0.5, 47.5), (63.5, 47.5)]),
            line(3, [(63.4999999, 3), (63.4999999, 9)]),
            line(4, [(63.5, 47.5), (63.4, 47.4)]),
        ]
        self.hand_made("border", 64, 48, [(image, lines)])
        for shares in ("1,0,0", "0,0,1"):
            out = self.export("ulsd", "--split", shares, data="border")
            files = glob.glob(out + "/dataset/dlsd_2/t*/*.npz") + glob.glob(out + "/dataset/dlsd/*.npz")
            self.assertEqual(len(files), 4 if shares == "1,0,0" else 2)
            files += glob.glob(self.export("lcnn", "--split", shares, data="border") + "/t*/*.npz")
            for path in files:
                with arrays(path) as npz:
                    for key in ("junc", "lpos", "line", "lneg"):
                        if key in npz and npz[key].size:
                            self.assertTrue(np.all((npz[key] >= 0) & (npz[key] < 128)), (path, key))
                            self.assertTrue(np.all(np.floor(npz[key]) < 128))

    def test_one_pixel(self):
        image = np.array([[77]], np.uint8)
        lines = [line(0, [(-0.5, -0.2), (0.5, 0.1)]), line(1, [(0.0, -0.5), (0.1, 0.5)])]
        self.hand_made("pixel", 1, 1, [(image, lines)])
        for name in ("ulsd", "lcnn", "coco-line", "deeplsd", "webdataset"):
            self.export(name, "--split", "1,0,0", data="pixel")
        out = self.export("lcnn", "--split", "1,0,0", data="pixel")
        with arrays(out + "/train/000000_0_label.npz") as npz:
            self.assertEqual(len(npz["lpos"]), 2)

    def test_edges_of_the_network_image_are_where_the_lines_are(self):
        # A step between columns 511 and 512 of 1024, and between rows 99 and 100 of 300: the
        # line at 511.5 | 512 from the corner is at 64 of the heat map, at 256 of the image.
        image = np.zeros((300, 1024), np.uint8)
        image[:, 512:] = 120
        image[150:] += 100
        lines = [line(0, [(511.5, 0), (511.5, 299)]), line(1, [(0, 149.5), (1023, 149.5)])]
        self.hand_made("steps", 1024, 300, [(image, lines)])
        for name, stem in (("ulsd", "dataset/dlsd_2/train/000000_{}.png"), ("lcnn", "train/000000_{}.png")):
            out = self.export(name, "--split", "1,0,0", data="steps")
            for flip in range(4):
                shown = self.read(os.path.join(out, stem.format(flip)))
                self.assertEqual(shown.shape, (512, 512, 3))
                wanted = np.zeros((512, 512), int)
                wanted[:, 256:] = 120
                wanted[256:] += 100
                wanted = wanted[:: -1 if flip & 2 else 1, :: -1 if flip & 1 else 1]
                # Enlarged in y, which makes the step a ramp of a pixel or two.
                clear = np.r_[0:254, 258:512]
                for channel in range(3):
                    np.testing.assert_array_equal(shown[clear, :, channel], wanted[clear])
                ramp = shown[254:258, 0, 0].astype(int)
                np.testing.assert_allclose(ramp + ramp[::-1], wanted[0, 0] + wanted[-1, 0], atol=1)

    def read(self, path):
        import dlsd_dataset

        with open(path, "rb") as file:
            return dlsd_dataset.decode_png(file.read())


class Program(Export):
    def test_filters(self):
        out = self.export("webdataset", "--min-length", 12.5, "--min-contrast", 20, "--split", "1,0,0")
        with tarfile.open(out + "/train-000000.tar") as tar:
            for i, labels in enumerate(self.labels):
                record = json.load(tar.extractfile(f"{i:06}.json"))
                wanted = [
                    l for l in labels["lines"] if l["length_px"] >= 12.5 and l["contrast"] >= 20
                ]
                self.assertEqual(record["lines"], wanted)
                ids = {l["id"] for l in wanted}
                for junction in record["junctions"]:
                    self.assertGreaterEqual(len(junction["lines"]), 2)
                    self.assertLessEqual(set(junction["lines"]), ids)

    def test_same_bytes_every_time(self):
        names = ("ulsd", "lcnn", "coco-line", "deeplsd", "webdataset")
        first = {name: tree(self.export(name)) for name in names}
        time.sleep(1.1)  # Formats have clocks of seconds.
        for name in names:
            again = subprocess.run(
                [DLSD, "export", "--format", name, "--data", "data", "--out", "again"],
                cwd=self.folder,
                capture_output=True,
                env={**os.environ, "TZ": "Asia/Tokyo"},
                check=True,
            )
            self.assertIn(b"14 frames (", again.stdout)
            self.assertEqual(tree(self.folder + "/again"), first[name])
            shutil.rmtree(self.folder + "/again")

    def test_refusals(self):
        def refused(*arguments, says, code=2):
            done = run("export", *arguments, cwd=self.folder, code=code)
            self.assertIn(says, done.stderr)
            self.assertEqual((done.stdout, done.stderr.count("\n")), ("", 1))

        ulsd = ("--format", "ulsd", "--data", "data", "--out")
        refused(*ulsd, "data", says="data: is there already")
        refused("--format", "npz", "--data", "data", "--out", "o", says="npz")
        refused("--format", "ulsd", "--data", "nowhere", "--out", "o", says="nowhere")
        refused(*ulsd, "o", "--split", "0.5,0.5", says="--split")
        refused(*ulsd, "o", "--split", "0.5,0.5,0.5", says="sum to 1")
        refused(*ulsd, "o", "--split", "nan,0.5,0.5", says="split")
        refused(*ulsd, "o", "--order", "5", says="5")
        refused(*ulsd, "o", "--name", "a/b", says="a/b")
        refused(*ulsd, "o", "--min-length", "-1", says="min_length")
        refused(*ulsd, "/proc/o", says="/proc/o", code=3)
        self.assertFalse(os.path.exists(self.folder + "/o"))
        os.mkdir(self.folder + "/mine.partial")
        refused(*ulsd, "mine", says="mine.partial")
        os.mkdir(self.folder + "/empty")
        run("export", *ulsd, "empty/", cwd=self.folder)

    def test_interrupted_and_killed(self):
        command = [DLSD, "export", "--format", "ulsd", "--data", "data", "--out", "cut"]

        def start():
            process = subprocess.Popen(command, cwd=self.folder, stderr=subprocess.PIPE, text=True)
            # When the first frames are there.
            deadline = time.time() + 60
            while not glob.glob(self.folder + "/cut.partial/dataset/dlsd_2/train/*_3.npz"):
                self.assertLess(time.time(), deadline)
                self.assertIsNone(process.poll(), "too fast to be stopped")
                time.sleep(0.005)
            return process

        for which, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            process = start()
            process.send_signal(which)
            _, err = process.communicate()
            self.assertEqual((process.returncode, err), (code, "dlsd: interrupted: nothing was written\n"))
            self.assertFalse(glob.glob(self.folder + "/cut*"))
        process = start()
        process.kill()
        process.communicate()
        self.assertTrue(os.path.isdir(self.folder + "/cut.partial"))
        self.assertFalse(os.path.exists(self.folder + "/cut"))
        subprocess.run(command, cwd=self.folder, check=True, capture_output=True)
        self.assertEqual(tree(self.folder + "/cut"), tree(self.export("ulsd")))

    def test_disk_full(self):
        done = subprocess.run(
            ["sh", "-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"", DLSD, "export", "--format",
             "coco-line", "--data", "data", "--out", "full"],
            cwd=self.folder, capture_output=True, text=True, check=False,
        )
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, r"^dlsd: full\.partial/.*: cannot be written: File too large\n$")
        self.assertFalse(glob.glob(self.folder + "/full*"))


if __name__ == "__main__":
    unittest.main()
