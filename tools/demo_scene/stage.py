"""Builds a layout in Blender and takes its photographs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from .cameras import LENS_MM, SENSOR_MM, Camera
from .grounds import lawn, table, wall
from .layout import Layout, Light
from .materials import make_all
from .props import ITEMS, Garden


def build(layout: Layout) -> None:
    """Empties Blender's scene and puts the garden into it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    garden = Garden(make_all(layout.palette), np.random.default_rng([layout.seed, 1]))
    lawn(garden)
    wall(garden)
    table(garden, layout.cloth_x, layout.cloth_width)
    for item in layout.items:
        ITEMS[item.kind](garden, (item.x, item.y, item.z), item.turn, item.size)
    _light(layout.light)


def _light(light: Light) -> None:
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = light.strength
    sun.angle = np.radians(2.5)
    sun.color = (1.0, 1.0 - 0.12 * light.warmth, 1.0 - 0.3 * light.warmth)
    lamp = bpy.data.objects.new("sun", sun)
    lamp.rotation_euler = (np.radians(90 - light.elevation), 0.0, np.radians(light.azimuth - 180))
    bpy.context.collection.objects.link(lamp)
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.62, 0.76, 1.0, 1.0)
    background.inputs["Strength"].default_value = light.sky


def settings(width: int, height: int, samples: int, exposure: float = 0.0) -> None:
    """Cycles on the CPU with a fixed seed, denoised, through a plain sRGB view."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.seed = 1
    scene.cycles.use_denoising = True
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    scene.cycles.denoising_prefilter = "FAST"
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.max_bounces = 3
    scene.cycles.diffuse_bounces = 2
    scene.cycles.caustics_reflective = False
    scene.cycles.caustics_refractive = False
    scene.render.use_persistent_data = True
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    scene.view_settings.exposure = exposure


def shoot(
    cameras: list[Camera], folder: Path, change_lens: Callable[[], None] | None = None
) -> None:
    """Renders every camera to `folder`/NAME.png; pictures already there are kept.

    `change_lens` may make another lens of the scene's camera before the first.
    """
    scene = bpy.context.scene
    lens = bpy.data.cameras.new("lens")
    lens.lens, lens.sensor_width = LENS_MM, SENSOR_MM
    tripod = bpy.data.objects.new("camera", lens)
    scene.collection.objects.link(tripod)
    scene.camera = tripod
    if change_lens:
        change_lens()
    folder.mkdir(parents=True, exist_ok=True)
    for camera in cameras:
        target = folder / f"{camera.name}.png"
        if target.exists():
            continue
        pose = np.eye(4)
        # Blender's cameras look along -z with y up; COLMAP's along +z with y down.
        pose[:3, :3] = camera.rotation.T @ np.diag([1.0, -1.0, -1.0])
        pose[:3, 3] = camera.center
        tripod.matrix_world = Matrix(pose.tolist())
        scene.render.filepath = str(target)
        bpy.ops.render.render(write_still=True)
