"""Structure from motion over the renders, its check against the true poses, and the small model.

The renders go through COLMAP like photographs: it sees no pose and no focal length.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap

from .cameras import Camera, focal_pixels
from .meshes import Array

SEED = 0
MIN_TRACK = 3  # A point seen twice only is as likely a mismatch between two bricks as a point.
MAX_ERROR = 1.0  # Pixels in the large renders.
MAX_POINTS = 4500  # More would only make the demo heavier to ship.
PEAK_THRESHOLD = 0.003  # Half of COLMAP's: the lawn is dark and fine.
CELLS = 60  # Cells along the scene's longer side when points are thinned.
PINHOLE = 1  # COLMAP's model number; parameters fx, fy, cx, cy.


def reconstruct(renders: Path, work: Path) -> Any:
    """SIFT, exhaustive matching and incremental mapping; all views must register."""
    database = work / "database.db"
    database.unlink(missing_ok=True)
    pycolmap.set_random_seed(SEED)
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "SIMPLE_PINHOLE"
    extraction = pycolmap.FeatureExtractionOptions()
    extraction.use_gpu = False
    extraction.sift.peak_threshold = PEAK_THRESHOLD
    extraction.num_threads = 1  # Here and below: with more, results depend on timing.
    pycolmap.extract_features(
        database, renders, camera_mode=pycolmap.CameraMode.SINGLE, reader_options=reader,
        extraction_options=extraction, device=pycolmap.Device.cpu,
    )  # fmt: skip
    matching = pycolmap.FeatureMatchingOptions()
    matching.use_gpu = False
    matching.num_threads = 1
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = SEED
    pycolmap.match_exhaustive(
        database,
        matching_options=matching,
        verification_options=verification,
        device=pycolmap.Device.cpu,
    )
    mapping = pycolmap.IncrementalPipelineOptions()
    mapping.random_seed = mapping.mapper.random_seed = SEED
    mapping.triangulation.random_seed = SEED
    mapping.num_threads = mapping.mapper.num_threads = 1
    models = pycolmap.incremental_mapping(database, renders, work / "sfm", options=mapping)
    model = max(models.values(), key=lambda candidate: candidate.num_reg_images())
    total = len(list(renders.glob("*.png")))
    if model.num_reg_images() != total:
        raise SystemExit(f"only {model.num_reg_images()} of {total} views registered")
    return model


def align(source: Array, target: Array) -> tuple[float, Array, Array]:
    """Umeyama's similarity (scale, rotation, shift) that brings points (N, 3) onto others."""
    mean_source, mean_target = source.mean(axis=0), target.mean(axis=0)
    a, b = source - mean_source, target - mean_target
    u, singular, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ np.diag(sign) @ vt
    scale = float((singular * sign).sum() / (a**2).sum())
    return scale, rotation, mean_target - scale * rotation @ mean_source


def compare(model: Any, truth: list[Camera], width: int) -> dict[str, Any]:
    """Errors of the recovered poses after alignment: millimeters, degrees, and the focal length."""
    by_name = {Path(image.name).stem: image for image in model.images.values()}
    poses = [by_name[camera.name].cam_from_world() for camera in truth]
    rotations = np.stack([pose.rotation.matrix() for pose in poses])
    shifts = np.stack([pose.translation for pose in poses])
    centers = -np.einsum("nji,nj->ni", rotations, shifts)
    true_centers = np.stack([camera.center for camera in truth])
    scale, turn, shift = align(centers, true_centers)
    residual = 1000 * np.linalg.norm(scale * centers @ turn.T + shift - true_centers, axis=1)
    angles = []
    for found, camera in zip(rotations, truth):
        difference = found @ turn.T @ camera.rotation.T
        skew = (difference - difference.T) / 2
        sine = np.linalg.norm([skew[2, 1], skew[0, 2], skew[1, 0]])
        angles.append(float(np.degrees(np.arctan2(sine, (np.trace(difference) - 1) / 2))))
    focal = next(iter(model.cameras.values())).params[0]
    return {
        "center_error_mm": _mean_and_max(residual),
        "rotation_error_deg": _mean_and_max(np.array(angles)),
        "focal_error_percent": round(100 * (focal / focal_pixels(width) - 1), 3),
        "all_points": model.num_points3D(),
        "all_mean_error_px": round(model.compute_mean_reprojection_error(), 3),
    }


def _mean_and_max(values: Array) -> dict[str, float]:
    return {"mean": round(float(values.mean()), 4), "max": round(float(values.max()), 4)}


def _thinned(model: Any) -> list[int]:
    """At most `MAX_POINTS` well-observed points: the best of every cell of space, then seconds."""
    good = [
        (-point.track.length(), point.error, number)
        for number, point in model.points3D.items()
        if point.track.length() >= MIN_TRACK and point.error <= MAX_ERROR
    ]
    good.sort()
    places = np.array([model.points3D[number].xyz for _, _, number in good])
    low, high = np.percentile(places, [2, 98], axis=0)
    cells = np.floor((places - low) / (high - low).max() * CELLS).astype(int)
    taken: dict[tuple[int, ...], int] = {}
    ranked = []
    for order, cell in enumerate(map(tuple, cells.tolist())):
        taken[cell] = taken.get(cell, 0) + 1
        ranked.append((taken[cell], order))
    return sorted(good[order][2] for _, order in sorted(ranked)[:MAX_POINTS])


def write_small(model: Any, folder: Path, width: int, photos: Path) -> dict[str, Any]:
    """Writes cameras.bin, images.bin and points3D.bin for photos shrunk to `width` pixels.

    Keeps the well-observed points and only the 2D observations that belong to one of them.
    """
    folder.mkdir(parents=True)
    camera = next(iter(model.cameras.values()))
    ratio = width / camera.width
    focal, cx, cy = camera.params
    size = (width, round(camera.height * ratio))
    camera_record = struct.pack(
        "<QiiQQ4d", 1, 1, PINHOLE, *size, *(ratio * np.array([focal, focal, cx, cy]))
    )
    (folder / "cameras.bin").write_bytes(camera_record)

    renumbered = {number: new for new, number in enumerate(_thinned(model), start=1)}

    images = sorted(model.images.values(), key=lambda image: image.name)
    observations: dict[int, list[tuple[int, int]]] = {number: [] for number in renumbered}
    records = [struct.pack("<Q", len(images))]
    for new_image, image in enumerate(images, start=1):
        pose = image.cam_from_world()
        x, y, z, w = pose.rotation.quat
        name = f"{Path(image.name).stem}.jpg"
        if not (photos / name).is_file():
            raise SystemExit(f"{photos / name} is missing")
        seen = [p for p in image.points2D if p.has_point3D() and p.point3D_id in renumbered]
        records.append(struct.pack("<i7di", new_image, w, x, y, z, *pose.translation, 1))
        records.append(name.encode() + b"\0" + struct.pack("<Q", len(seen)))
        for index, spot in enumerate(seen):
            records.append(struct.pack("<ddq", *(ratio * spot.xy), renumbered[spot.point3D_id]))
            observations[spot.point3D_id].append((new_image, index))
    (folder / "images.bin").write_bytes(b"".join(records))

    records = [struct.pack("<Q", len(renumbered))]
    for number, new in renumbered.items():
        point = model.points3D[number]
        track = observations[number]
        records.append(struct.pack("<Q3d3Bd", new, *point.xyz, *point.color, ratio * point.error))
        records.append(
            struct.pack("<Q", len(track)) + b"".join(struct.pack("<ii", *o) for o in track)
        )
    (folder / "points3D.bin").write_bytes(b"".join(records))
    errors = [ratio * model.points3D[number].error for number in renumbered]
    return {
        "points": len(renumbered),
        "observations": sum(len(track) for track in observations.values()),
        "mean_error_px": round(float(np.mean(errors)), 3),
        "focal_px": round(float(ratio * focal), 3),
        "size": list(size),
    }
