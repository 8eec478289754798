use super::*;

fn ddcolor() -> &'static str {
    BUILT_IN[0].text
}

#[test]
fn built_in_profiles_are_sound_and_have_their_names() {
    for built_in in BUILT_IN {
        let profile = built_in.profile().unwrap();
        for name in built_in.names {
            assert_eq!(named(&name.to_uppercase()).unwrap(), profile);
        }
    }
    let message = named("colorful").unwrap_err().to_string();
    for part in ["colorful", "ddcolor", "eccv16", "deoldify-browser"] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn what_is_wrong_with_a_manifest_is_named() {
    for (from, to, expected) in [
        ("size = 512\n", "", "missing field `size`"),
        ("size = 512", "sise = 512", "unknown field `sise`"),
        (
            "size = 512",
            "size = 512\ncolor = 1",
            "line 10: unknown field `color`",
        ),
        ("size = 512", "size = \"large\"", "line 9: "),
        ("size = 512", "size = 0", "size: "),
        ("size = 512", "size = 99999", "size: "),
        ("size_multiple = 1", "size_multiple = 7", "size: "),
        ("size_multiple = 1", "size_multiple = 0", "size: "),
        ("[\"image\"]", "[]", "inputs: "),
        ("[\"image\"]", "[\"image\", \"image\"]", "inputs: "),
        (
            "[\"image\"]",
            "[\"image\", \"style\"]",
            "unknown variant `style`",
        ),
        ("[\"image\"]", "[\"image\", \"hints\"]", "hint_range: "),
        ("[\"image\"]", "[\"image\", \"noise\"]", "noise_std: "),
        ("size = 512", "noise_std = 1\nsize = 512", "noise_std: "),
        ("size = 512", "class = 1\nsize = 512", "class: "),
        ("mean = [0, 0, 0]", "mean = [0]", "mean and std: "),
        ("std = [1, 1, 1]", "std = [1, 0, 1]", "mean and std: "),
        ("std = [1, 1, 1]", "std = [1, nan, 1]", "mean and std: "),
        (
            "input_range = [0, 1]",
            "input_range = [1, 1]",
            "input_range",
        ),
        (
            "input_range = [0, 1]",
            "input_range = [0, inf]",
            "input_range",
        ),
        ("\"stretch\"", "\"crop\"", "`stretch`"),
        ("\"bilinear\"", "\"bicubic\"", "`average`"),
        ("\"ab\"", "\"lab\"", "`rgb`"),
        ("\"gray-rgb\"", "\"rgb\"", "`gray-rgb`"),
        ("size = 512", "size = ", "line 9: "),
    ] {
        let text = ddcolor().replacen(from, to, 1);
        assert_ne!(text, ddcolor());
        let reason = Profile::parse(&text).unwrap_err();
        assert!(reason.contains(expected), "{to}: {reason}");
        assert!(!reason.contains('\n'), "{reason}");
    }
}

#[test]
fn sides_follow_the_model_then_the_way_of_resizing() {
    let stretched = named("deoldify").unwrap();
    assert_eq!(stretched.input_size([800, 600], [None; 2], 256), [256, 256]);
    assert_eq!(
        stretched.input_size([800, 600], [Some(64), None], 256),
        [64, 256]
    );
    let short = named("bigcolor").unwrap();
    // 256 · 4/3 = 341.3, and the next multiple of 16 is 352.
    assert_eq!(short.input_size([800, 600], [None; 2], 256), [352, 256]);
    assert_eq!(short.input_size([600, 800], [None; 2], 256), [256, 352]);
    assert_eq!(short.input_size([800, 600], [None; 2], 240), [320, 240]);
    assert_eq!(short.input_size([7, 7], [None; 2], 256), [256, 256]);
    assert_eq!(short.input_size([1, 60_000], [None; 2], 256), [256, 8192]);
    assert_eq!(short.input_size([800, 600], [Some(32); 2], 256), [32, 32]);
}

#[test]
fn ranges_mean_deviation_and_lightness() {
    let mut profile = named("ddcolor").unwrap();
    profile.input_range = [-1.0, 1.0];
    (profile.mean, profile.std) = (vec![0.5, 0.0, 0.0], vec![0.25, 1.0, 1.0]);
    assert_eq!(profile.image_value(0.75, 0), 0.0);
    assert_eq!(profile.image_value(0.75, 1), 0.5);
    profile.output_range = [-1.0, 1.0];
    assert_eq!((profile.ab(1.0), profile.ab(-0.5)), (110.0, -55.0));
    assert_eq!((profile.rgb(0.0), profile.rgb(3.0)), (0.5, 1.0));
    // CIE: L* of an encoded gray of 0.5 is 53.389, not 50.
    let caffe = named("caffe-v2").unwrap();
    assert!((caffe.image_value(0.5, 0) - 3.389).abs() < 1e-3);
}
