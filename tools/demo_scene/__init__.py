"""A procedural garden still life, rendered with Blender's Cycles.

`meshes` makes vertex arrays, `nodes` and `materials` the procedural surfaces, `props` the things
in the garden, `layout` says where they stand (the demo by hand, training scenes by chance),
`stage` turns a layout into a Blender scene, `cameras` places the photographer and `sfm` recovers
the poses from the pictures alone.
"""
