"""A command of COLMAP's with its options as names and values, by pycolmap."""

import sys

import pycolmap

MODES = {
    "ImageReader.single_camera": pycolmap.CameraMode.SINGLE,
    "ImageReader.single_camera_per_folder": pycolmap.CameraMode.PER_FOLDER,
    "ImageReader.single_camera_per_image": pycolmap.CameraMode.PER_IMAGE,
}


def feature_extractor(options):
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = options["ImageReader.camera_model"]
    if "ImageReader.mask_path" in options:
        reader.mask_path = options["ImageReader.mask_path"]
    modes = [mode for name, mode in MODES.items() if name in options]
    pycolmap.extract_features(
        options["database_path"],
        options["image_path"],
        camera_mode=modes[0],
        reader_options=reader,
        device=pycolmap.Device.cpu,
    )


def sequential_matcher(options):
    pairing = pycolmap.SequentialPairingOptions()
    pairing.overlap = int(options["SequentialMatching.overlap"])
    pairing.quadratic_overlap = options["SequentialMatching.quadratic_overlap"] == "1"
    pycolmap.match_sequential(
        options["database_path"], pairing_options=pairing, device=pycolmap.Device.cpu
    )


def matches_importer(options):
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = options["match_list_path"]
    pycolmap.match_image_pairs(
        options["database_path"], pairing_options=pairing, device=pycolmap.Device.cpu
    )


def exhaustive_matcher(options):
    pycolmap.match_exhaustive(options["database_path"], device=pycolmap.Device.cpu)


def mapper(options):
    pycolmap.incremental_mapping(
        options["database_path"], options["image_path"], options["output_path"]
    )


def main(command, *words):
    options = dict(zip(words[::2], words[1::2]))
    pycolmap.set_random_seed(int(options["random_seed"]))
    matchers = [sequential_matcher, matches_importer, exhaustive_matcher]
    commands = [feature_extractor, *matchers, mapper]
    {known.__name__: known for known in commands}[command](options)


main(*sys.argv[1:])
