"""dlsd_dataset.py against datasets of the program and images made by hand."""

import json
import os
import shutil
import sys
import tempfile
import unittest

import dlsd_dataset
import numpy as np
from dataset_maker import camera_yaml, png, run

FRAMES = 12


class Reader(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="dlsd-reader-test-")
        for name, text in {
            "wide": camera_yaml("pinhole", "fov", "[56.0, 56.0, 79.5, 59.5]", "[0.93]", 160, 120),
            "straight": camera_yaml("pinhole", "none", "[80.0, 81.0, 39.5, 29.5]", "[]", 80, 60),
        }.items():
            with open(f"{cls.folder}/{name}.yaml", "w", encoding="utf-8") as file:
                file.write(text)
        cls.data = cls.folder + "/data"
        run("generate", "--camera", "wide.yaml", "--camera", "straight.yaml", "--count", FRAMES,
            "--planes", "depth", "--out", "data", cwd=cls.folder)  # fmt: skip

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_frames(self):
        dataset = dlsd_dataset.Dataset(self.data)
        self.assertEqual(len(dataset), FRAMES)
        for i, frame in enumerate(dataset):
            image, lines, camera = frame
            self.assertEqual((frame.index, frame.name), (i, f"{i:06}"))
            self.assertEqual(image.shape, (camera.height, camera.width))
            self.assertEqual(image.dtype, np.uint8)
            self.assertEqual(camera.name, ["wide", "straight"][i % 2])
            self.assertTrue(os.path.exists(camera.file))
            with open(f"{self.data}/labels/{i:06}.json", encoding="utf-8") as file:
                record = json.load(file)
            self.assertEqual([line.id for line in lines], [line["id"] for line in record["lines"]])
            self.assertGreater(len(lines), 5)
            for line in lines:
                self.assertTrue(np.all(line.points > -0.5 - 1e-6))
                self.assertTrue(np.all(line.points < [camera.width - 0.5 + 1e-6, camera.height - 0.5 + 1e-6]))
                np.testing.assert_allclose(line.points_in_cam @ line.normal, 0, atol=1e-6)
                if camera.model == "pinhole":  # 3D ends, camera and curve fit each other.
                    p = camera.params
                    for point, pixel in zip(line.points_in_cam, line.points[[0, -1]]):
                        projected = point[:2] / point[2] * (p["fx"], p["fy"]) + (p["cx"], p["cy"])
                        np.testing.assert_allclose(projected, pixel, atol=1e-5)
            self.assertEqual(frame.cam_from_world.shape, (4, 4))
            self.assertEqual(frame.plane("depth").shape, image.shape)
            self.assertTrue(np.all(frame.plane("depth") >= 0))

    def test_splits_are_those_of_the_export(self):
        run("export", "--format", "coco-line", "--data", "data", "--out", "coco", cwd=self.folder)
        run("export", "--format", "coco-line", "--data", "data", "--out", "other",
            "--split", "0.5,0.25,0.25", cwd=self.folder)  # fmt: skip
        for out, shares in (("coco", dlsd_dataset.SHARES), ("other", (0.5, 0.25, 0.25))):
            names = []
            for split in dlsd_dataset.SPLITS:
                own = [f.name for f in dlsd_dataset.Dataset(self.data, split, shares)]
                self.assertEqual(
                    [n + ".png" for n in own], sorted(os.listdir(f"{self.folder}/{out}/{split}2017"))
                )
                names += own
            self.assertEqual(len(set(names)), FRAMES)
        counts = [sum(dlsd_dataset.split_of(i) == s for i in range(10000)) for s in dlsd_dataset.SPLITS]
        np.testing.assert_allclose(counts, [8000, 1000, 1000], atol=3)
        for n in (2, 4, 5, 10):  # Nor does any camera of n miss one.
            share = np.mean([dlsd_dataset.split_of(i) == "test" for i in range(0, 20000, n)])
            self.assertAlmostEqual(share, 0.1, delta=0.01)
        with self.assertRaises(ValueError):
            dlsd_dataset.Dataset(self.data, "valid")

    def test_png(self):
        rng = np.random.default_rng(1)
        for shape in ((1, 1), (7, 9), (23, 11), (5, 30, 3)):
            for kind in (np.uint8, np.uint16):
                image = rng.integers(0, np.iinfo(kind).max + 1, shape, dtype=kind)
                decoded = dlsd_dataset.decode_png(png(image))
                self.assertEqual(decoded.dtype, kind)
                np.testing.assert_array_equal(decoded, image)
        good = png(np.arange(60, dtype=np.uint8).reshape(6, 10))
        for bad in (b"", good[:-20], good[:50] + b"x" + good[51:], b"\xff" + good[1:]):
            with self.assertRaises(ValueError):
                dlsd_dataset.decode_png(bad)

    def test_libraries_and_own_decoder_agree(self):
        try:
            import cv2
        except ImportError:
            self.skipTest("OpenCV is not installed for Python")
        for i in range(3):
            path = f"{self.data}/images/{i:06}.png"
            with open(path, "rb") as file:
                own = dlsd_dataset.decode_png(file.read())
            np.testing.assert_array_equal(own, cv2.imread(path, cv2.IMREAD_UNCHANGED))


if __name__ == "__main__":
    unittest.main()
