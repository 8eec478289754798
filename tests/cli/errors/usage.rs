//! Command lines that clap refuses: exit code 2.

use super::{Case, case, nothing};

const fn usage(name: &'static str, command: &'static str, words: &'static [&'static str]) -> Case {
    Case {
        code: 2,
        ..case(name, nothing, command, words)
    }
}

pub(super) const CASES: &[Case] = &[
    usage("no such command", "paint scene", &["paint"]),
    usage("no such option", "fit scene --fast", &["--fast"]),
    usage("no folder", "fit", &["<COLMAP_DIR|RUN|BLOCK>"]),
    usage("no teacher", "colorize runs/scene", &["--teacher"]),
    usage("no output to render to", "render runs/scene", &["--output"]),
    usage("no output to export to", "export runs/scene", &["--output"]),
    usage("no path", "info", &["<PATH>"]),
    usage(
        "no number",
        "fit scene --iterations many",
        &["many", "--iterations"],
    ),
    usage(
        "no iterations",
        "fit scene --iterations 0",
        &["0", "--iterations"],
    ),
    usage(
        "no splats",
        "fit scene --max-splats 0",
        &["0", "--max-splats"],
    ),
    usage(
        "photos too small",
        "fit scene --max-side 15",
        &["15", "--max-side"],
    ),
    usage(
        "a degree too high",
        "fit scene --sh-degree 4",
        &["4", "--sh-degree"],
    ),
    usage(
        "no time",
        "fit scene --time-limit 0",
        &["--time-limit", "a number above 0"],
    ),
    usage(
        "a time limit and iterations",
        "fit scene --time-limit 1 --iterations 100",
        &["--time-limit", "--iterations"],
    ),
    usage(
        "a target that is no number",
        "fit scene --target-psnr high",
        &["high", "--target-psnr", "above 0"],
    ),
    usage(
        "numerics of no kind",
        "fit scene --numerics alpha-min=0.01,speed=fast",
        &[
            "speed=fast",
            "alpha-min=",
            "depth-bits=32|24|16",
            "--numerics",
        ],
    ),
    usage(
        "a cut-off of nothing",
        "fit scene --numerics alpha-min=0",
        &["alpha-min=0", "0.00001..0.1"],
    ),
    usage(
        "an effect of no scene",
        "plan scene --with fog",
        &["fog", "--with"],
    ),
    usage(
        "an effect on and off",
        "fit scene --with lens --without exposure --without lens",
        &["--with lens", "--without lens"],
    ),
    usage(
        "a chroma degree too high",
        "colorize --teacher t --sh-degree 4",
        &["4", "--sh-degree"],
    ),
    usage(
        "a range upside down",
        "fit scene --normalize 200,100",
        &["200,100", "--normalize", "LOW,HIGH"],
    ),
    usage(
        "no such channel",
        "fit scene --channel ir",
        &["ir", "--channel"],
    ),
    usage("a negative seed", "fit scene --seed=-1", &["-1", "--seed"]),
    usage(
        "no such preset",
        "fit scene --preset best",
        &["best", "--preset"],
    ),
    usage(
        "no such solver",
        "colorize --teacher t --solver newton",
        &["newton", "--solver"],
    ),
    usage(
        "no such views",
        "render --views some -o out",
        &["some", "--views"],
    ),
    usage(
        "until nothing",
        "colorize --teacher t --until 0",
        &["0", "--until"],
    ),
    usage(
        "more weights than teachers",
        "colorize --teacher t --weights 1,2",
        &["--weights", "2 numbers for 1 teachers"],
    ),
    usage(
        "a weight of nothing",
        "colorize --teacher t --weights 0",
        &["0", "--weights", "above 0"],
    ),
    usage(
        "weights without teachers",
        "colorize --hints h --weights 1",
        &["--teacher"],
    ),
    usage(
        "too strong",
        "colorize --teacher t --strength 1.5",
        &["1.5", "--strength", "0 to 1"],
    ),
    usage(
        "a teacher of no size",
        "colorize --teacher t --teacher-size 0",
        &["0", "--teacher-size"],
    ),
    usage(
        "no such way of enlarging",
        "colorize --teacher t --upsample sharp",
        &["sharp", "--upsample"],
    ),
    usage(
        "no such knob",
        "tradeoff scene --knobs rounds,speed",
        &["speed", "--knobs", "max-side", "chroma-degree"],
    ),
    usage(
        "no option of fit",
        "tradeoff scene -- --max-side 200 --colour",
        &["--colour"],
    ),
    usage(
        "two folders for a point",
        "tradeoff scene -- -o out",
        &["--output", "multiple"],
    ),
    usage(
        "no time at all",
        "tradeoff scene --budget 0",
        &["0", "--budget"],
    ),
    usage("two folders", "fit scene scene", &["scene"]),
];
