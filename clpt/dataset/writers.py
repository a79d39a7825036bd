"""Forms of datasets: files of each picture, and what sums them up at the end."""

from __future__ import annotations

import io
import json
import tarfile
from abc import ABC, abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from clpt import images
from clpt.dataset.picture import Picture
from clpt.dataset.truth import Truth
from clpt.errors import SceneError
from clpt.files import output_files

MILLIMETRE = 1000.0  # in a metre
SHARD = 1000  # pictures of a tar
MOST_OBJECTS = MOST_DEPTH = 65535  # uint16


class Writer(ABC):
    """Writes pictures into a folder; finished pictures are never opened again."""

    def __init__(self, folder: Path):
        self.folder = folder

    @abstractmethod
    def write(self, picture: Picture) -> dict[str, Any]:
        """Write a picture's files; return the arguments of its record and of `finish`."""

    def finish(self, records: Iterable[dict[str, Any]]) -> None:  # noqa: B027
        """Write what sums up all pictures, from their records by number."""

    def put(self, name: str, content: bytes) -> str:
        """Write a file of the folder at once and whole; return its name."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        output_files.write(path, content)
        return name


def png(values: np.ndarray) -> bytes:
    """Return a PNG of uint8 (h, w) or (h, w, 3), or of uint16 (h, w)."""
    file = io.BytesIO()
    Image.fromarray(values).save(file, "PNG", compress_level=1)
    return file.getvalue()


def npy(values: np.ndarray) -> bytes:
    """Return a .npy."""
    file = io.BytesIO()
    np.save(file, values, allow_pickle=False)
    return file.getvalue()


def codes(picture: Picture) -> np.ndarray:
    """Return the picture as sRGB bytes (h, w, 3)."""
    return np.asarray(images.to_srgb8(picture.image))


def numbers(truth: Truth) -> np.ndarray:
    """Return the instances as uint16 (h, w). Raises SceneError for more objects than it holds."""
    if len(truth.names) > MOST_OBJECTS:
        message = f"{len(truth.names)} objects; files with 16 bits hold {MOST_OBJECTS}"
        raise SceneError(message, where="shapes")
    return truth.instances.astype(np.uint16)


def labels(truth: Truth) -> dict[str, Any]:
    """Return the camera and the objects of a record, as JSON."""
    visibility, amodal = truth.visibility, truth.amodal_boxes
    objects = []
    for i, name in enumerate(truth.names):
        row = {
            "name": name, "category": truth.categories[i], "instance": i + 1,
            "box": truth.boxes[i].tolist(), "visible_pixels": int(truth.visible[i]),
            "pose": truth.poses[i].tolist(), "size": truth.sizes[i].tolist(),
        }  # fmt: skip
        if visibility is not None and amodal is not None:
            share = None if np.isnan(visibility[i]) else float(visibility[i])
            row |= {"amodal_box": amodal[i].tolist(), "visibility": share}
        objects.append(row)
    matrix = None if truth.matrix is None else truth.matrix.tolist()
    return {"world_to_camera": truth.camera.tolist(), "intrinsics": matrix, "objects": objects}


def layers(picture: Picture) -> dict[str, bytes]:
    """Return the files of a picture by their endings."""
    files = {"rgb.png": png(codes(picture))}
    if picture.truth is not None:
        files["depth.npy"] = npy(picture.truth.depth.astype(np.float32))
        files["normal.npy"] = npy(picture.truth.normal.astype(np.float16))
        files["instances.png"] = png(numbers(picture.truth))
    return files


class Folders(Writer):
    """A folder for each kind of file: rgb/000000.png, depth/000000.npy, truth/000000.json."""

    def write(self, picture: Picture) -> dict[str, Any]:
        """Write the picture's files, and its labels."""
        for ending, content in layers(picture).items():
            folder, suffix = ending.split(".")
            self.put(f"{folder}/{picture.index:06d}.{suffix}", content)
        if picture.truth is None:
            return {}
        text = json.dumps(labels(picture.truth), indent=1) + "\n"
        self.put(f"truth/{picture.index:06d}.json", text.encode())
        return {}


class WebDataset(Writer):
    """Shards of 1000 pictures, shard-000000.tar, whose members share a picture's number."""

    def write(self, picture: Picture) -> dict[str, Any]:
        """Write the picture's members as a tar in `parts`."""
        files = layers(picture)
        if picture.truth is not None:
            files["json"] = json.dumps(labels(picture.truth)).encode()
        whole = io.BytesIO()
        with tarfile.open(fileobj=whole, mode="w", format=tarfile.USTAR_FORMAT) as tar:
            for ending, content in files.items():
                member = tarfile.TarInfo(f"{picture.index:06d}.{ending}")
                member.size = len(content)
                tar.addfile(member, io.BytesIO(content))
        self.put(self.part(picture.index), whole.getvalue())
        return {}

    def part(self, index: int) -> str:
        """Return the name of a picture's tar before it is in a shard."""
        return f"parts/{index:06d}.tar"

    def finish(self, records: Iterable[dict[str, Any]]) -> None:
        """Join the pictures' tars to shards."""
        indices = [record["index"] for record in records]
        for first in range(0, len(indices), SHARD):
            name = self.folder / f"shard-{first // SHARD:06d}.tar"
            parts = [self.folder / self.part(i) for i in indices[first : first + SHARD]]
            if name.exists() and not all(part.exists() for part in parts):
                continue  # of a run that was killed after it had written this shard
            with output_files.replacing(name) as path, open(path, "wb") as shard:
                for part in parts:
                    with tarfile.open(part) as tar:
                        end = max(m.offset_data + -(-m.size // 512) * 512 for m in tar)
                    shard.write(part.read_bytes()[:end])
                shard.write(bytes(1024))
            for part in parts:
                part.unlink(missing_ok=True)


class Coco(Writer):
    """COCO's detection: images, and annotations.json with masks as run lengths."""

    def write(self, picture: Picture) -> dict[str, Any]:
        """Write the picture and the instances' masks."""
        truth = _needed(picture)
        name = self.put(f"images/{picture.index:06d}.png", png(codes(picture)))
        self.put(f"instances/{picture.index:06d}.png", png(numbers(truth)))
        annotations = []
        for i, label in enumerate(labels(truth)["objects"]):
            if truth.visible[i]:
                runs = run_lengths(truth.instances == i + 1)
                annotations.append({**label, "segmentation": runs, "area": int(truth.visible[i])})
        height, width = truth.depth.shape
        return {"file_name": name, "width": width, "height": height, "annotations": annotations}

    def finish(self, records: Iterable[dict[str, Any]]) -> None:
        """Write annotations.json; categories count from 1 in the order of their names."""
        names = set[str]()
        pictures, annotations = list[dict[str, Any]](), list[dict[str, Any]]()
        for record in records:
            number = record["index"] + 1
            fields = {key: record[key] for key in ("file_name", "width", "height")}
            pictures.append({"id": number, **fields})
            for label in record["annotations"]:
                names.add(label["category"])
                annotations.append({
                    "id": len(annotations) + 1, "image_id": number, "iscrowd": 0,
                    "category": label["category"], "bbox": label["box"], "name": label["name"],
                    "area": label["area"], "segmentation": label["segmentation"],
                })  # fmt: skip
        numbers = {name: i for i, name in enumerate(sorted(names), 1)}
        for annotation in annotations:
            annotation["category_id"] = numbers[annotation.pop("category")]
        categories = [{"id": i, "name": name, "supercategory": ""} for name, i in numbers.items()]
        document = {"images": pictures, "annotations": annotations, "categories": categories}
        self.put("annotations.json", json.dumps(document).encode())


def run_lengths(mask: np.ndarray) -> dict[str, Any]:
    """Return COCO's uncompressed run lengths of a mask (h, w): column by column, from zeros on."""
    column = np.concatenate([[False], mask.ravel(order="F")])
    changes = np.flatnonzero(column[1:] != column[:-1])
    counts = np.diff(np.concatenate([[0], changes, [mask.size]]))
    return {"size": list(mask.shape), "counts": counts.tolist()}


class Bop(Writer):
    """BOP's scene 000000: rgb, depth [mm / 10], masks, scene_gt, scene_camera, scene_gt_info."""

    SCENE, SCALE = "000000", 0.1  # millimetres of a step of depth

    def write(self, picture: Picture) -> dict[str, Any]:
        """Write the picture, its depth and masks; needs a camera with intrinsics."""
        truth, index = _needed(picture), picture.index
        if truth.matrix is None:
            message = f"BOP needs intrinsics, which a {picture.scene.camera.kind} camera has not"
            raise SceneError(message, where="camera")
        depth = np.rint(truth.depth * MILLIMETRE / self.SCALE)
        depth[depth > MOST_DEPTH] = 0.0  # missing, as BOP has it
        self.put(f"{self.SCENE}/rgb/{index:06d}.png", png(codes(picture)))
        self.put(f"{self.SCENE}/depth/{index:06d}.png", png(depth.astype(np.uint16)))
        for i in range(len(truth.names)):
            visible = truth.instances == i + 1
            whole = visible if truth.silhouettes is None else truth.silhouettes[i]
            for name, mask in (("mask", whole), ("mask_visib", visible)):
                self.put(f"{self.SCENE}/{name}/{index:06d}_{i:06d}.png", png(mask * np.uint8(255)))
        return labels(truth)

    def finish(self, records: Iterable[dict[str, Any]]) -> None:
        """Write the three files of the scene, and the numbers of the objects."""
        poses, cameras, facts = {}, {}, {}
        kept = list(records)
        names = sorted({label["category"] for record in kept for label in record["objects"]})
        for record in kept:
            key, camera = str(record["index"]), np.array(record["world_to_camera"])
            matrix = np.ravel(record["intrinsics"]).tolist()
            cameras[key] = {
                "cam_K": matrix, "depth_scale": self.SCALE,
                "cam_R_w2c": camera[:3, :3].ravel().tolist(),
                "cam_t_w2c": (MILLIMETRE * camera[:3, 3]).tolist(),
            }  # fmt: skip
            poses[key] = [_pose(label, camera, names) for label in record["objects"]]
            facts[key] = [_fact(label) for label in record["objects"]]
        for name, document in (
            ("scene_gt", poses), ("scene_camera", cameras), ("scene_gt_info", facts)
        ):  # fmt: skip
            self.put(f"{self.SCENE}/{name}.json", json.dumps(document).encode())
        self.put(
            "objects.json", json.dumps({str(i): name for i, name in enumerate(names, 1)}).encode()
        )


def _pose(label: dict[str, Any], camera: np.ndarray, names: list[str]) -> dict[str, Any]:
    """Return an object's pose in the camera, as scene_gt.json has it."""
    matrix = camera @ np.array(label["pose"])
    return {
        "obj_id": names.index(label["category"]) + 1,
        "cam_R_m2c": matrix[:3, :3].ravel().tolist(),
        "cam_t_m2c": (MILLIMETRE * matrix[:3, 3]).tolist(),
    }


def _fact(label: dict[str, Any]) -> dict[str, Any]:
    """Return an object's boxes and visibility, as scene_gt_info.json has them."""
    visible, share = label["visible_pixels"], label.get("visibility")
    whole = round(visible / share) if share else visible
    return {
        "bbox_visib": label["box"] if visible else [-1, -1, -1, -1],
        "bbox_obj": label.get("amodal_box", label["box"]),
        "px_count_visib": visible, "px_count_valid": whole, "px_count_all": whole,
        "visib_fract": share or 0.0,
    }  # fmt: skip


class Hdf5(Writer):
    """A file for each picture, as BlenderProc has it: colors, depth, normals, instance_segmaps."""

    def write(self, picture: Picture) -> dict[str, Any]:
        """Write 000000.hdf5, by h5py."""
        try:
            import h5py
        except ImportError:
            raise SceneError("HDF5 needs h5py: pip install 'clpt[dataset]'") from None
        parts: dict[str, Any] = {"colors": codes(picture)}
        if picture.truth is not None:
            truth = picture.truth
            parts |= {
                "depth": truth.depth.astype(np.float32), "normals": truth.normal.astype(np.float16),
                "instance_segmaps": numbers(truth),
            }  # fmt: skip
        file = io.BytesIO()
        with h5py.File(file, "w") as group:
            for name, values in parts.items():
                group.create_dataset(name, data=values, compression="gzip", compression_opts=1)
            if picture.truth is not None:
                group["instance_attribute_maps"] = json.dumps(labels(picture.truth))
        self.put(f"{picture.index:06d}.hdf5", file.getvalue())
        return {}


def _needed(picture: Picture) -> Truth:
    if picture.truth is None:
        raise SceneError("this form of a dataset needs ground truth", where="truth")
    return picture.truth


WRITERS: dict[str, type[Writer]] = {
    "folders": Folders, "coco": Coco, "bop": Bop, "hdf5": Hdf5, "webdataset": WebDataset,
}  # fmt: skip
