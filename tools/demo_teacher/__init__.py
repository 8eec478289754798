"""A toy colorization network for the demo garden, with DDColor's tensor contract.

`data` renders gardens that are not the demo and cuts training crops, `network` is the U-Net,
`training` fits it and `export` writes it as ONNX and looks at what it does.
"""
