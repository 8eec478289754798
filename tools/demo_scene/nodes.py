"""A thin way to write Blender shader graphs as expressions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

Color = tuple[float, float, float]
Socket = Any  # a bpy.types.NodeSocket; bpy ships no usable type stubs


class Graph:
    """One material under construction. Methods add a node and return its output socket."""

    def __init__(self, name: str) -> None:
        """Starts an empty material."""
        self.material = bpy.data.materials.new(name)
        self.tree = self.material.node_tree
        self.tree.nodes.clear()

    def node(self, kind: str, inputs: dict[str, Any] | None = None, **settings: Any) -> Any:
        """Adds a node, sets its properties, and links or sets its inputs by name."""
        node = self.tree.nodes.new(kind)
        for key, value in settings.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            self._feed(node.inputs[key], value)
        return node

    def _feed(self, socket: Socket, value: Any) -> None:
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif isinstance(value, tuple) and len(value) == 3 and socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    def position(self, stretch: Color = (1.0, 1.0, 1.0)) -> Socket:
        """Object-space position, scaled per axis, and shifted from object to object."""
        coordinate = self.node("ShaderNodeTexCoord").outputs["Object"]
        shift = self.math("MULTIPLY", self.per_object(), 40.0)
        inputs = {"Vector": coordinate, "Scale": stretch, "Location": shift}
        return self.node("ShaderNodeMapping", inputs).outputs[0]

    def attribute(self, name: str) -> Socket:
        """A named vertex attribute as a vector."""
        return self.node("ShaderNodeAttribute", attribute_name=name).outputs["Vector"]

    def component(self, vector: Socket, axis: str) -> Socket:
        """One component ("X", "Y" or "Z") of a vector."""
        return self.node("ShaderNodeSeparateXYZ", {"Vector": vector}).outputs[axis]

    def per_object(self) -> Socket:
        """A number in [0, 1) that differs from object to object."""
        return self.node("ShaderNodeObjectInfo").outputs["Random"]

    def per_piece(self) -> Socket:
        """A number in [0, 1) that differs between unconnected pieces of one mesh."""
        return self.node("ShaderNodeNewGeometry").outputs["Random Per Island"]

    def noise(
        self, vector: Socket, scale: float, detail: float = 4.0, rough: float = 0.55,
        distortion: float = 0.0,
    ) -> Socket:  # fmt: skip
        """Fractal noise in about [0, 1]."""
        return self.node(
            "ShaderNodeTexNoise",
            {"Vector": vector, "Scale": scale, "Detail": detail, "Roughness": rough,
             "Distortion": distortion},
        ).outputs[0]  # fmt: skip

    def cells(self, vector: Socket, scale: float, output: str = "Distance") -> Socket:
        """Voronoi cells: "Distance" to the nearest seed, or its random "Color"."""
        return self.node("ShaderNodeTexVoronoi", {"Vector": vector, "Scale": scale}).outputs[output]

    def bands(self, vector: Socket, scale: float, distortion: float, axis: str = "X") -> Socket:
        """Distorted stripes across `axis`."""
        return self.node(
            "ShaderNodeTexWave",
            {"Vector": vector, "Scale": scale, "Distortion": distortion, "Detail": 3.0,
             "Detail Scale": 1.5},
            bands_direction=axis,
        ).outputs["Factor"]  # fmt: skip

    def math(self, operation: str, a: Socket | float, b: Socket | float = 0.0) -> Socket:
        """A scalar operation, clamped to nothing."""
        node = self.tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        self._feed(node.inputs[0], a)
        self._feed(node.inputs[1], b)
        return node.outputs[0]

    def ramp(self, value: Socket, stops: Sequence[tuple[float, Color]]) -> Socket:
        """A color by linear interpolation between (position, color) stops."""
        node = self.node("ShaderNodeValToRGB", {"Fac": value})
        elements = node.color_ramp.elements
        while len(elements) < len(stops):
            elements.new(1.0)
        for element, (place, color) in zip(elements, stops):
            element.position = place
            element.color = (*color, 1.0)
        return node.outputs["Color"]

    def step(self, value: Socket, low: float, high: float) -> Socket:
        """0 below `low`, 1 above `high`, linear between."""
        node = self.node("ShaderNodeMapRange", {"Value": value, "From Min": low, "From Max": high})
        return node.outputs[0]

    def mix(
        self, factor: Socket | float, a: Socket | Color, b: Socket | Color, mode: str = "MIX"
    ) -> Socket:
        """Blends two colors."""
        node = self.tree.nodes.new("ShaderNodeMix")
        node.data_type = "RGBA"
        node.blend_type = mode
        self._feed(node.inputs[0], factor)
        self._feed(node.inputs[6], a)
        self._feed(node.inputs[7], b)
        return node.outputs[2]

    def finish(
        self, color: Socket | Color, roughness: Socket | float = 0.6,
        bump: Socket | None = None, depth: float = 0.002, coat: float = 0.0,
        translucent: float = 0.0,
    ) -> Any:  # fmt: skip
        """Closes the graph with a principled surface; `depth` is the bump's height in meters."""
        inputs: dict[str, Any] = {
            "Base Color": color, "Roughness": roughness, "Coat Weight": coat,
            "Coat Roughness": 0.15, "Specular IOR Level": 0.4,
        }  # fmt: skip
        if bump is not None:
            inputs["Normal"] = self.node(
                "ShaderNodeBump", {"Height": bump, "Distance": depth, "Strength": 1.0}
            ).outputs[0]
        surface = self.node("ShaderNodeBsdfPrincipled", inputs).outputs[0]
        if translucent > 0.0:
            through = self.node("ShaderNodeBsdfTranslucent", {"Color": color}).outputs[0]
            blend = self.tree.nodes.new("ShaderNodeMixShader")
            self._feed(blend.inputs[0], translucent)
            self._feed(blend.inputs[1], surface)
            self._feed(blend.inputs[2], through)
            surface = blend.outputs[0]
        output = self.node("ShaderNodeOutputMaterial")
        self.tree.links.new(surface, output.inputs["Surface"])
        return self.material
