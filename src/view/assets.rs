//! The files of the page. `assets/viewer/` holds them as modules of a browser; here they become
//! one script, so that a page that is sent to someone needs nothing beside it.

/// The page, which names [`STYLE`] and [`script`].
pub const PAGE: &str = include_str!("../../assets/viewer/index.html");

/// Style sheet.
pub const STYLE: &str = include_str!("../../assets/viewer/style.css");

/// Files of paint mode, which a page that is sent does not have, and their names.
pub const PAINT_NAMES: [&str; 10] = [
    "paint.js",
    "brush.js",
    "choices.js",
    "color.js",
    "easel.js",
    "mixer.js",
    "pixels.js",
    "strip.js",
    "talk.js",
    "paint.css",
];
pub const PAINT: [&str; 10] = [
    include_str!("../../assets/viewer/paint/paint.js"),
    include_str!("../../assets/viewer/paint/brush.js"),
    include_str!("../../assets/viewer/paint/choices.js"),
    include_str!("../../assets/viewer/paint/color.js"),
    include_str!("../../assets/viewer/paint/easel.js"),
    include_str!("../../assets/viewer/paint/mixer.js"),
    include_str!("../../assets/viewer/paint/pixels.js"),
    include_str!("../../assets/viewer/paint/strip.js"),
    include_str!("../../assets/viewer/paint/talk.js"),
    include_str!("../../assets/viewer/paint/paint.css"),
];

/// Page, script and style of the studio.
pub const STUDIO: [&str; 3] = [
    include_str!("../../assets/viewer/studio/index.html"),
    include_str!("../../assets/viewer/studio/studio.js"),
    include_str!("../../assets/viewer/studio/studio.css"),
];

/// The modules, each behind those that it imports.
const MODULES: [&str; 10] = [
    include_str!("../../assets/viewer/scene.js"),
    include_str!("../../assets/viewer/sorter.js"),
    include_str!("../../assets/viewer/shaders.js"),
    include_str!("../../assets/viewer/camera.js"),
    include_str!("../../assets/viewer/controls.js"),
    include_str!("../../assets/viewer/compare.js"),
    include_str!("../../assets/viewer/panel.js"),
    include_str!("../../assets/viewer/renderer.js"),
    include_str!("../../assets/viewer/source.js"),
    include_str!("../../assets/viewer/main.js"),
];

/// All modules as one: without imports, and with nothing exported.
pub fn script() -> String {
    let lines = MODULES.iter().flat_map(|module| module.lines());
    let kept = lines.filter(|line| !line.starts_with("import "));
    kept.flat_map(|line| [line.strip_prefix("export ").unwrap_or(line), "\n"])
        .collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Names that a module declares at its top level.
    fn declared(module: &str) -> Vec<&str> {
        let mut names = Vec::new();
        for line in module.lines() {
            let line = line.strip_prefix("export ").unwrap_or(line);
            let line = line.strip_prefix("async ").unwrap_or(line);
            let Some((kind, rest)) = line.split_once(' ') else {
                continue;
            };
            if !["const", "let", "function", "class"].contains(&kind) {
                continue;
            }
            let end = rest.find([' ', '(', '=']).unwrap_or(rest.len());
            match rest.strip_prefix('[') {
                Some(list) => names.extend(list.split(']').next().unwrap_or("").split(", ")),
                // Of GLSL in between, names follow types.
                None if ["const", "let"].contains(&kind)
                    && !rest[end..].trim_start().starts_with(['=', ';']) => {}
                None => names.push(&rest[..end]),
            }
        }
        names
    }

    #[test]
    fn modules_fit_into_one() {
        let mut known = BTreeSet::new();
        for module in MODULES {
            for line in module.lines().filter(|line| line.starts_with("import ")) {
                let names = line.split(['{', '}']).nth(1).expect("names in braces");
                assert!(line.ends_with(';'), "one line each: {line}");
                for name in names.split(',').map(str::trim) {
                    assert!(known.contains(name), "{name} comes later");
                }
            }
            for name in declared(module) {
                assert!(known.insert(name), "{name} is declared twice");
            }
        }
        assert!(known.contains("Renderer") && known.contains("canvas"));
        let script = script();
        assert!(!script.contains("\nexport ") && !script.contains("\nimport "));
        // It has to fit between two tags.
        assert!(!script.contains("</script") && !script.contains("<!--"));
    }
}
