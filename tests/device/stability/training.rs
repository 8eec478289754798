//! Whole trainings on worlds that break trainers: each stays finite, and reaches
//! the PSNR of its twin in ordinary coordinates.

use std::{
    collections::BTreeMap,
    sync::{Arc, LazyLock},
};

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::{Camera, downscale},
    low_level::oracle::random::Random,
    luma::{LumaError, LumaProgress, LumaSettings, LumaTrainer, Schedule, TrainingView},
    measure::psnr,
    raster::{Field, Geometry, Raster, Renderer},
    splats::{ShField, Splats, init::initial_splats, sh},
};

use crate::gpu;

/// Iterations of each training.
const ITERATIONS: usize = 150;

/// A twin may end this many dB away: the same arithmetic in other units rounds
/// differently, and a training amplifies that.
const BAND: f64 = 0.5;

/// Unit scale and pose of a world, relative to the ordinary one.
#[derive(Clone, Copy)]
struct Frame {
    scale: f64,
    rotation: DMat3,
    shift: DVec3,
}

impl Frame {
    const ORDINARY: Self = Self {
        scale: 1.0,
        rotation: DMat3::IDENTITY,
        shift: DVec3::ZERO,
    };

    fn point(&self, point: DVec3) -> DVec3 {
        self.scale * (self.rotation * point) + self.shift
    }
}

/// Photos and points of a world.
struct World {
    cameras: Vec<Camera>,
    photos: Vec<Vec<u8>>,
    points: Vec<([f32; 3], f32)>,
    extent: f64,
}

static RASTER: LazyLock<Arc<Raster>> = LazyLock::new(|| Arc::new(Raster::new(gpu())));

/// A camera at `center` (ordinary coordinates) that looks at the origin.
fn camera(center: DVec3, frame: Frame) -> Camera {
    let forward = -center.normalize();
    let right = DVec3::Y.cross(forward).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose()
        * frame.rotation.transpose();
    Camera {
        width: 64,
        height: 48,
        fx: 70.0,
        fy: 70.0,
        cx: 32.0,
        cy: 24.0,
        rotation,
        translation: -(rotation * frame.point(center)),
    }
}

/// A patchwork floor with bumps on it, photographed from `views` places.
fn world(frame: Frame, views: usize) -> World {
    let mut random = Random::new(5);
    let (mut splats, mut points) = (Vec::new(), Vec::new());
    for i in 0..18 * 14 {
        let [x, y] = [(i % 18) as f64 / 6.0 - 1.5, (i / 18) as f64 / 6.0 - 1.1];
        let height = if i % 7 == 0 {
            random.range(0.1, 0.5)
        } else {
            0.0
        };
        let gray = random.range(0.1, 0.9);
        let place = frame.point(DVec3::new(x, y, -height));
        let near =
            frame.point(DVec3::new(x, y, -height) + DVec3::from_array(random.array(-0.03, 0.03)));
        splats.push((place.as_vec3().to_array(), gray));
        points.push((near.as_vec3().to_array(), gray as f32));
    }
    let truth = Splats {
        means: splats.iter().map(|s| s.0).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; splats.len()],
        log_scales: vec![[(0.09 * frame.scale).ln() as f32; 3]; splats.len()],
        opacity_logits: vec![3.0; splats.len()],
        sh: ShField {
            degree: 0,
            channels: 1,
            coefficients: splats
                .iter()
                .map(|s| ((s.1 - 0.5) / sh::C0) as f32)
                .collect(),
        },
    };
    let cameras: Vec<Camera> = (0..views)
        .map(|i| {
            let angle = i as f64 * 1.3;
            camera(
                DVec3::new(1.2 * angle.cos(), 1.2 * angle.sin(), -3.2),
                frame,
            )
        })
        .collect();
    let extent = 1.4 * frame.scale;
    let photos = pictures(&truth, &cameras, extent)
        .into_iter()
        .map(|picture| {
            picture
                .into_iter()
                .map(|v| (v * 255.0).round() as u8)
                .collect()
        })
        .collect();
    World {
        cameras,
        photos,
        points,
        extent,
    }
}

fn pictures(splats: &Splats, cameras: &[Camera], extent: f64) -> Vec<Vec<f32>> {
    pictures_with(&RASTER, splats, cameras, extent)
}

fn pictures_with(
    raster: &Arc<Raster>,
    splats: &Splats,
    cameras: &[Camera],
    extent: f64,
) -> Vec<Vec<f32>> {
    let geometry = Geometry::upload(gpu(), splats).unwrap();
    let field = Field::upload(gpu(), &splats.sh).unwrap();
    let mut renderer = Renderer::new(raster.clone(), geometry, vec![field], 0.01 * extent).unwrap();
    (cameras.iter())
        .map(|camera| renderer.render(camera).unwrap().remove(0).pixels)
        .collect()
}

fn trained_from(
    world: &World,
    start: &Splats,
    iterations: usize,
) -> Result<(Splats, Vec<LumaProgress>), LumaError> {
    trained_with(world, start, settings(start, iterations))
}

fn settings(start: &Splats, iterations: usize) -> LumaSettings {
    LumaSettings {
        sh_degree: start.sh.degree,
        max_splats: 2 * start.len(),
        ..LumaSettings::new(iterations)
    }
}

fn trained_with(
    world: &World,
    start: &Splats,
    settings: LumaSettings,
) -> Result<(Splats, Vec<LumaProgress>), LumaError> {
    let schedule = Schedule::of(&settings);
    trained_by(world, start, settings, schedule)
}

fn trained_by(
    world: &World,
    start: &Splats,
    settings: LumaSettings,
    schedule: Schedule,
) -> Result<(Splats, Vec<LumaProgress>), LumaError> {
    let views: Vec<TrainingView> = (world.cameras.iter().zip(&world.photos))
        .map(|(camera, gray)| TrainingView::new(camera.clone(), gray.clone()))
        .collect();
    let mut trainer = LumaTrainer::new(RASTER.clone(), settings, world.extent, start, views)?;
    trainer.follow(schedule);
    let mut reports = Vec::new();
    trainer.train(&mut |progress| reports.push(progress))?;
    Ok((trainer.splats()?, reports))
}

/// Trains; everything must be finite, nothing poisoned. Gives the mean PSNR over the photos.
fn train(world: &World) -> f64 {
    let start = initial_splats(&world.points, world.extent as f32, 1);
    let (splats, reports) = trained_from(world, &start, ITERATIONS).unwrap();
    assert_sound(&splats, &reports);
    mean_psnr(world, &splats)
}

fn mean_psnr(world: &World, splats: &Splats) -> f64 {
    mean_psnr_with(&RASTER, world, splats)
}

fn mean_psnr_with(raster: &Arc<Raster>, world: &World, splats: &Splats) -> f64 {
    let pictures = pictures_with(raster, splats, &world.cameras, world.extent);
    let wanted = |photo: &[u8]| {
        photo
            .iter()
            .map(|&v| f32::from(v) / 255.0)
            .collect::<Vec<_>>()
    };
    let all: Vec<f64> = (pictures.iter().zip(&world.photos))
        .map(|(picture, photo)| psnr(picture, &wanted(photo)))
        .collect();
    all.iter().sum::<f64>() / all.len() as f64
}

fn assert_sound(splats: &Splats, reports: &[LumaProgress]) {
    assert!(!splats.means.is_empty());
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
    assert!(finite(splats.means.as_flattened()));
    assert!(finite(splats.quats.as_flattened()));
    assert!(finite(splats.log_scales.as_flattened()));
    assert!(finite(&splats.opacity_logits) && finite(&splats.sh.coefficients));
    assert!(
        reports
            .iter()
            .all(|r| r.loss.is_finite() && r.poisoned == 0)
    );
}

static ORDINARY: LazyLock<f64> = LazyLock::new(|| train(&world(Frame::ORDINARY, 5)));

#[test]
fn worlds_of_any_size_place_and_attitude_train_alike() {
    assert!(*ORDINARY > 24.0, "{} dB", *ORDINARY);
    let turned = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 2.0);
    let frames = [
        (
            "a thousandth",
            Frame {
                scale: 1e-3,
                ..Frame::ORDINARY
            },
        ),
        (
            "ten thousand",
            Frame {
                scale: 1e4,
                ..Frame::ORDINARY
            },
        ),
        (
            "turned",
            Frame {
                rotation: turned,
                ..Frame::ORDINARY
            },
        ),
        // Poses are recentered when they are read: what is left is a few extents.
        (
            "shifted",
            Frame {
                shift: DVec3::new(5.0, -7.0, 3.0),
                ..Frame::ORDINARY
            },
        ),
    ];
    let reached: BTreeMap<_, _> = frames
        .map(|(name, frame)| (name, train(&world(frame, 5))))
        .into();
    println!("ordinary {:.2} dB, {reached:.2?}", *ORDINARY);
    for (name, psnr) in reached {
        let away = psnr - *ORDINARY;
        assert!(
            away.abs() < BAND,
            "{name}: {psnr:.2} dB, {away:+.2} from its twin"
        );
    }
}

/// Photos of which every other one is a quarter as wide, cameras as well.
fn mixed_sizes(mut world: World) -> World {
    for index in (1..world.cameras.len()).step_by(2) {
        let camera = &mut world.cameras[index];
        let (width, height) = (camera.width as usize, camera.height as usize);
        let pixels: Vec<[u8; 1]> = world.photos[index].iter().map(|&v| [v]).collect();
        let small = [width / 4, height / 4];
        world.photos[index] = downscale(&pixels, [width, height], small).into_flattened();
        *camera = camera.resized(small[0] as u32, small[1] as u32);
    }
    world
}

#[test]
fn mixed_sizes_train_better_antialiased() {
    let world = mixed_sizes(world(Frame::ORDINARY, 8));
    let start = initial_splats(&world.points, world.extent as f32, 1);
    let [plain, antialiased] = [false, true].map(|antialiased| {
        let settings = LumaSettings {
            antialiased,
            ..settings(&start, ITERATIONS)
        };
        let raster = RASTER.drawing(settings.raster_options());
        let (splats, reports) = trained_with(&world, &start, settings).unwrap();
        assert_sound(&splats, &reports);
        mean_psnr_with(&raster, &world, &splats)
    });
    println!("{plain:.2} dB without, {antialiased:.2} dB with");
    assert!(antialiased > plain + 0.3, "{antialiased} and {plain}");
}

#[test]
fn one_photo_trains() {
    assert!(train(&world(Frame::ORDINARY, 1)) > 24.0);
}

/// It is culled and counted, and leaves no gradient that would have to be refused.
#[test]
fn a_poisoned_gaussian_among_others_trains() {
    let world = world(Frame::ORDINARY, 3);
    let mut start = initial_splats(&world.points, world.extent as f32, 1);
    start.log_scales[7][1] = f32::NAN;
    start.opacity_logits[9] = f32::NAN;
    start.log_scales[11] = [200.0; 3];
    let (splats, reports) = trained_from(&world, &start, 20).unwrap();
    let last = reports.last().unwrap();
    // In every view.
    assert_eq!((last.poisoned, last.refused), (3 * 20, 0));
    assert!(last.loss.is_finite() && splats.means.as_flattened().iter().all(|v| v.is_finite()));
}

#[test]
fn three_points_train() {
    let mut world = world(Frame::ORDINARY, 5);
    world.points.truncate(3);
    assert!(train(&world) > 10.0);
}

#[test]
fn coplanar_and_duplicated_points_train() {
    let mut flat = world(Frame::ORDINARY, 5);
    flat.points.iter_mut().for_each(|point| point.0[2] = 0.0);
    assert!(train(&flat) > 22.0);
    let mut doubled = world(Frame::ORDINARY, 5);
    doubled.points.extend_from_within(..);
    assert!(train(&doubled) > 22.0);
    let mut collapsed = world(Frame::ORDINARY, 5);
    let first = collapsed.points[0].0;
    collapsed
        .points
        .iter_mut()
        .for_each(|point| point.0 = first);
    assert!(train(&collapsed) > 5.0);
}

#[test]
fn a_camera_inside_a_gaussian_trains() {
    let world = world(Frame::ORDINARY, 5);
    let mut start = initial_splats(&world.points, world.extent as f32, 1);
    let center = world.cameras[2].center().as_vec3();
    start.means[0] = (center * 0.99).to_array();
    start.log_scales[0] = [0.0; 3];
    let (splats, reports) = trained_from(&world, &start, ITERATIONS).unwrap();
    assert_sound(&splats, &reports);
    assert!(reports.last().unwrap().loss < reports[0].loss);
}

#[test]
fn black_white_and_constant_photos_train() {
    for gray in [0, 255, 128] {
        let mut world = world(Frame::ORDINARY, 3);
        world.photos.iter_mut().for_each(|photo| photo.fill(gray));
        assert!(train(&world) > 20.0, "{gray}");
    }
}

/// A rule that would remove every Gaussian removes none.
#[test]
fn a_rule_that_would_remove_all_removes_none() {
    let world = world(Frame::ORDINARY, 2);
    let start = initial_splats(&world.points, world.extent as f32, 0);
    let mut settings = settings(&start, 70);
    settings.prune_opacity = 1.1;
    let schedule = Schedule {
        densify_from: 0,
        densify_every: 30,
        ..Schedule::of(&settings)
    };
    let (splats, reports) = trained_by(&world, &start, settings, schedule).unwrap();
    assert_sound(&splats, &reports);
    assert_eq!(splats.len(), start.len());
}

/// Every Gaussian in one tile: one workgroup has all the work.
#[test]
fn a_hundred_thousand_gaussians_in_one_tile_train() {
    let mut world = world(Frame::ORDINARY, 2);
    for (camera, photo) in world.cameras.iter_mut().zip(&mut world.photos) {
        *camera = camera.resized(16, 12);
        photo.truncate(16 * 12);
    }
    let mut random = Random::new(3);
    let points: Vec<_> = (0..100_000)
        .map(|_| (random.array(-0.3, 0.3).map(|v| v as f32), 0.5))
        .collect();
    let mut start = initial_splats(&points, 1.4, 0);
    start.opacity_logits.fill(-5.0);
    let (splats, reports) = trained_from(&world, &start, 10).unwrap();
    assert_sound(&splats, &reports);
    assert!(splats.len() > 50_000);
}

/// One photo at 8K, of which the rows from `first` on are kept.
fn eight_k(first: usize, rows: usize) -> World {
    let mut world = world(Frame::ORDINARY, 1);
    let camera = &mut world.cameras[0];
    *camera = camera.resized(7680, 4320);
    camera.height = rows as u32;
    camera.cy -= first as f64;
    let small = &world.photos[0];
    let pixels = (first * 7680..(first + rows) * 7680).map(|p| (p / 7680, p % 7680));
    world.photos[0] = pixels.map(|(y, x)| small[y / 90 * 64 + x / 120]).collect();
    world
}

/// 129,600 tiles, buffers next to the smallest binding limit there is. One iteration.
#[test]
#[ignore = "half a minute on two cores without a GPU: make test-all"]
fn photos_of_8k_train() {
    let mut world = eight_k(0, 4320);
    world.points.truncate(12);
    let start = initial_splats(&world.points, world.extent as f32, 0);
    let (splats, reports) = trained_from(&world, &start, 1).unwrap();
    assert_sound(&splats, &reports);
}

/// The middle of such a photo, for more iterations.
#[test]
fn strips_as_wide_as_8k_train() {
    let world = eight_k(2152, 16);
    let start = initial_splats(&world.points, world.extent as f32, 1);
    let before = mean_psnr(&world, &start);
    let (splats, reports) = trained_from(&world, &start, 12).unwrap();
    assert_sound(&splats, &reports);
    let after = mean_psnr(&world, &splats);
    assert!(after > before + 1.0, "{before} {after}");
}
