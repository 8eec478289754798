//! SuperSplat's camera animations: `document.json` of its projects (`.ssproj` is a ZIP file), and
//! `settings.json` of the viewers that it exports.
//!
//! Keys are joined by a cubic Hermite spline over place, target and field of view, whose tangents
//! are finite differences times a smoothness. Its world is a splat file's turned by half about z;
//! fields of view are those of a picture's longer side, in degrees.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::Value;

use super::{lens, looking};
use crate::capture::Camera;

/// SuperSplat's defaults where a file has none: frames, frames a second, smoothness, degrees.
const FRAMES: f64 = 180.0;
const RATE: f64 = 30.0;
const SMOOTHNESS: f64 = 1.0;
const FOV: f64 = 60.0;

/// Place, target, field of view.
const VALUES: usize = 7;

#[derive(Deserialize)]
struct Document {
    #[serde(rename = "poseSets")]
    pose_sets: Vec<PoseSet>,
    #[serde(default)]
    timeline: Timeline,
    #[serde(default)]
    camera: View,
}

#[derive(Default, Deserialize)]
struct View {
    fov: Option<f64>,
}

#[derive(Deserialize)]
struct PoseSet {
    poses: Vec<Pose>,
}

#[derive(Deserialize)]
struct Pose {
    frame: Option<f64>,
    position: [f64; 3],
    target: [f64; 3],
    fov: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Timeline {
    frames: Option<f64>,
    frame_rate: Option<f64>,
    smoothness: Option<f64>,
    #[serde(rename = "loop")]
    loops: Option<bool>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Track {
    duration: f64,
    frame_rate: f64,
    #[serde(default)]
    loop_mode: String,
    smoothness: Option<f64>,
    keyframes: Keyframes,
}

#[derive(Deserialize)]
struct Keyframes {
    times: Vec<f64>,
    values: Values,
}

#[derive(Deserialize)]
struct Values {
    position: Vec<f64>,
    target: Vec<f64>,
    #[serde(default)]
    fov: Vec<f64>,
}

/// Keys at times in frames.
struct Animation {
    keys: Vec<(f64, [f64; VALUES])>,
    frames: f64,
    rate: f64,
    smoothness: f64,
    loops: bool,
}

/// The cameras of an animation, of a size, and its frames a second; `None` where the value is
/// none.
///
/// # Errors
/// What about it cannot be.
pub(super) fn parse(
    value: &Value,
    size: [u32; 2],
    most: usize,
) -> Result<Option<(Vec<Camera>, f64)>, String> {
    let animation = if value.get("poseSets").is_some() {
        of_document(typed(value.clone())?)?
    } else if let Some(tracks) = value.get("animTracks") {
        let first = tracks
            .get(0)
            .ok_or("animTracks is empty: add keys to SuperSplat's timeline")?;
        of_track(typed(first.clone())?)?
    } else {
        return Ok(None);
    };
    let numbers = [animation.frames, animation.rate, animation.smoothness];
    let keys = animation
        .keys
        .iter()
        .flat_map(|(time, key)| key.iter().chain([time]));
    if !numbers.iter().chain(keys).all(|number| number.is_finite()) {
        return Err("has numbers that are not finite".to_owned());
    }
    if animation.rate <= 0.0 || animation.frames < 1.0 || animation.frames > most as f64 {
        return Err(format!(
            "has {} frames, {} a second: 1 to {most} can be drawn",
            animation.frames, animation.rate
        ));
    }
    let frames = animation.frames.round() as usize;
    let cameras = (0..frames).map(|frame| camera(animation.at(frame as f64), size));
    Ok(Some((cameras.collect::<Result<_, _>>()?, animation.rate)))
}

fn of_document(document: Document) -> Result<Animation, String> {
    let timeline = document.timeline;
    let rate = timeline.frame_rate.unwrap_or(RATE);
    let set = document.pose_sets.into_iter().next();
    let poses = set.map_or(Vec::new(), |set| set.poses);
    let usual = document.camera.fov.unwrap_or(FOV);
    let keys = poses.iter().enumerate().map(|(i, pose)| {
        let ([a, b, c], [d, e, f]) = (pose.position, pose.target);
        let time = pose.frame.unwrap_or(i as f64 * rate);
        (time, [a, b, c, d, e, f, pose.fov.unwrap_or(usual)])
    });
    Animation::new(
        keys.collect(),
        timeline.frames.unwrap_or(FRAMES),
        rate,
        timeline.smoothness.unwrap_or(SMOOTHNESS),
        timeline.loops.unwrap_or(true),
    )
}

fn of_track(track: Track) -> Result<Animation, String> {
    let Values {
        position,
        target,
        fov,
    } = &track.keyframes.values;
    let count = track.keyframes.times.len();
    if position.len() != 3 * count || target.len() != 3 * count {
        return Err(format!(
            "animTracks[0].keyframes has {count} times, {} positions and {} targets",
            position.len() / 3,
            target.len() / 3
        ));
    }
    let key = |i: usize| {
        let fov = fov.get(i).copied().unwrap_or(FOV);
        let [p, t] = [&position[3 * i..], &target[3 * i..]];
        [p[0], p[1], p[2], t[0], t[1], t[2], fov]
    };
    let times = track.keyframes.times.iter().enumerate();
    Animation::new(
        times.map(|(i, &time)| (time, key(i))).collect(),
        track.duration * track.frame_rate,
        track.frame_rate,
        track.smoothness.unwrap_or(SMOOTHNESS),
        track.loop_mode == "repeat",
    )
}

impl Animation {
    fn new(
        mut keys: Vec<(f64, [f64; VALUES])>,
        frames: f64,
        rate: f64,
        smoothness: f64,
        loops: bool,
    ) -> Result<Self, String> {
        keys.retain(|(time, _)| *time < frames);
        keys.sort_by(|a, b| a.0.total_cmp(&b.0));
        keys.dedup_by(|next, kept| next.0 == kept.0);
        if keys.is_empty() {
            return Err("has no camera keys: add some to SuperSplat's timeline".to_owned());
        }
        if loops && let ([first, second, ..], [.., before, last]) = (&keys[..], &keys[..]) {
            // The end leads on to the beginning.
            let [first, second, before, last] = [first, second, before, last].map(|key| *key);
            keys.insert(0, (last.0 - frames, last.1));
            keys.insert(0, (before.0 - frames, before.1));
            keys.push((first.0 + frames, first.1));
            keys.push((second.0 + frames, second.1));
        }
        Ok(Self {
            keys,
            frames,
            rate,
            smoothness,
            loops,
        })
    }

    /// Place, target and field of view at a time in frames.
    fn at(&self, time: f64) -> [f64; VALUES] {
        let keys = &self.keys;
        let next = keys.partition_point(|(t, _)| *t <= time);
        if next == 0 || next == keys.len() {
            debug_assert!(!self.loops || keys.len() == 1);
            return keys[next.min(keys.len() - 1)].1;
        }
        let [(t0, from), (t1, to)] = [keys[next - 1], keys[next]];
        let (length, t) = (t1 - t0, (time - t0) / (t1 - t0));
        let (t2, t3) = (t * t, t * t * t);
        let [m0, m1] = [self.tangent(next - 1), self.tangent(next)];
        std::array::from_fn(|k| {
            from[k] * (2.0 * t3 - 3.0 * t2 + 1.0)
                + length * m0[k] * (t3 - 2.0 * t2 + t)
                + to[k] * (3.0 * t2 - 2.0 * t3)
                + length * m1[k] * (t3 - t2)
        })
    }

    /// Change a frame at a key.
    fn tangent(&self, key: usize) -> [f64; VALUES] {
        let last = self.keys.len() - 1;
        let (t0, from) = self.keys[key.saturating_sub(1)];
        let (t1, to) = self.keys[(key + 1).min(last)];
        std::array::from_fn(|k| self.smoothness * (to[k] - from[k]) / (t1 - t0))
    }
}

/// A camera in the splat file's coordinates.
fn camera(key: [f64; VALUES], size: [u32; 2]) -> Result<Camera, String> {
    let [a, b, c, d, e, f, fov] = key;
    if !(fov > 0.0 && fov < 180.0) {
        return Err(format!("fov is {fov}: must lie between 0 and 180"));
    }
    let turn = DMat3::from_rotation_z(PI);
    let [place, target] = [[a, b, c], [d, e, f]].map(|v| turn * DVec3::from(v));
    let longer = f64::from(size[0].max(size[1]));
    let focal = 0.5 * longer / (0.5 * fov.to_radians()).tan();
    let like = Camera {
        fx: focal,
        fy: focal,
        ..lens(size, FOV)
    };
    Ok(looking(place, target, DVec3::NEG_Y, &like))
}

pub(super) fn typed<T: DeserializeOwned>(value: Value) -> Result<T, String> {
    serde_json::from_value(value).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(value: &Value) -> (Vec<Camera>, f64) {
        parse(value, [64, 48], 1000).unwrap().unwrap()
    }

    fn document(smoothness: f64, loops: bool) -> Value {
        let pose = |frame: u32, x: f64| json!({"name": "camera", "frame": frame, "position": [x, 1.0, 4.0], "target": [x, 1.0, 0.0], "fov": 90.0});
        json!({
            "version": 0,
            "poseSets": [{"name": "set0", "poses": [pose(20, 4.0), pose(0, 0.0), pose(10, 1.0)]}],
            "timeline": {"frames": 30, "frameRate": 10, "frame": 0, "smoothness": smoothness, "loop": loops},
        })
    }

    #[test]
    fn keys_are_gone_through_in_the_file_s_coordinates() {
        let (cameras, rate) = read(&document(0.0, false));
        assert_eq!((cameras.len(), rate), (30, 10.0));
        for (frame, x) in [(0, 0.0), (10, 1.0), (20, 4.0), (29, 4.0)] {
            let camera = &cameras[frame];
            assert!(
                camera.center().distance(DVec3::new(-x, -1.0, 4.0)) < 1e-9,
                "{frame}"
            );
            // Towards smaller z, upright where y points down; 90° across 64 pixels.
            assert!(camera.rotation.row(2).distance(DVec3::NEG_Z) < 1e-9);
            assert!(camera.rotation.row(1).distance(DVec3::Y) < 1e-9);
            assert!((camera.fx - 32.0).abs() < 1e-9);
        }
        // Without smoothness a key is left and met at rest: half the way at half the time.
        assert!((cameras[5].center().x + 0.5).abs() < 1e-9);
    }

    #[test]
    fn smooth_keys_are_met_at_the_mean_speed() {
        let (cameras, _) = read(&document(1.0, false));
        // Hermite between 0 and 1 with tangents 1 and 2 a segment, at its middle.
        let expected = 0.5 + (1.0 - 2.0) / 8.0;
        assert!((cameras[5].center().x + expected).abs() < 1e-9);
        let (looped, _) = read(&document(1.0, true));
        let step = looped[29].center().distance(looped[0].center());
        assert!(
            step < 0.6 && looped[10].center().distance(cameras[10].center()) < 1e-9,
            "{step}"
        );
    }

    #[test]
    fn a_viewer_s_settings() {
        let settings = |positions: &[f64]| {
            json!({"version": 2, "animTracks": [{
                "name": "cameraAnim", "duration": 3, "frameRate": 10, "loopMode": "none",
                "interpolation": "spline", "smoothness": 1,
                "keyframes": {"times": [0, 10, 20], "values": {
                    "position": positions, "target": [0, 1, 0, 1, 1, 0, 4, 1, 0], "fov": [90, 90, 90],
                }},
            }]})
        };
        let (cameras, rate) = read(&settings(&[0.0, 1.0, 4.0, 1.0, 1.0, 4.0, 4.0, 1.0, 4.0]));
        assert_eq!((cameras, rate), read(&document(1.0, false)));
        for (value, word) in [
            (settings(&[0.0]), "positions"),
            (json!({"animTracks": []}), "empty"),
            (json!({"poseSets": []}), "no camera keys"),
            (
                json!({"poseSets": [{"poses": [{"position": [0, 0, 0], "target": [0, 0, 1], "fov": 0}]}]}),
                "fov",
            ),
            (
                json!({"poseSets": [{"poses": [{"position": [0, 0, 0], "target": [0, 0, 1]}]}], "timeline": {"frames": 1e12}}),
                "frames",
            ),
        ] {
            let error = parse(&value, [64, 48], 1000).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
        assert_eq!(parse(&json!({}), [64, 48], 1000), Ok(None));
    }

    #[test]
    fn one_key_stands_still() {
        let one = json!({"poseSets": [{"poses": [{"position": [0, 0, 4], "target": [0, 0, 0]}]}], "timeline": {"frames": 3}});
        let (cameras, _) = read(&one);
        assert!(cameras.len() == 3 && cameras.iter().all(|camera| *camera == cameras[0]));
    }
}
