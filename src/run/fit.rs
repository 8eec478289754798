//! `fit`: photos to geometry and luma.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

use super::{
    Event, Observer, Preset, RunError, RunFolder, Stage,
    carve::{self, carved},
    files,
    scene::{Scene, counted, counts, gray_pixels, read_splats},
};
use crate::{
    capture::{Exposure, LoadOptions, Photo},
    color::gray_from_rgb,
    effects::{Backdrop, Effect, Overrules, Plan, Room},
    gpu::{Gpu, GpuError},
    luma::{Demand, Densification, LumaSettings, LumaTrainer, Numerics, TrainingView},
    measure,
    raster::{Raster, RasterOptions},
    report::{
        CaptureReport, DeviceReport, EffectReport, LumaQuality, LumaReport, LumaSeconds, LumaView,
        REPORT_VERSION, Report, ViewExposure, kernel_reports,
    },
    splats::{ShField, Splats, init::initial_splats, ply, sh},
};

/// PSNR of pictures without a difference, in dB: JSON knows no infinity.
pub(super) const IDENTICAL_PSNR: f64 = 100.0;

/// What `fit` is asked to do; `None` leaves it to the preset.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// The run folder; `runs/<folder name>` by default.
    pub output: Option<PathBuf>,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    pub preset: Option<Preset>,
    /// Iterations.
    pub iterations: Option<usize>,
    /// How photos are loaded; the longer side is the preset's where it is `None`.
    pub load: LoadOptions,
    /// Cap on Gaussians.
    pub max_splats: Option<usize>,
    /// Effects that are on or off whatever the evidence.
    pub overrules: Overrules,
    /// Seed.
    pub seed: u64,
    /// Gaussians to start from.
    pub init: Option<PathBuf>,
    /// How the set of Gaussians changes.
    pub densification: Densification,
    /// Share of the iterations, from the first on, that see photos at half their size.
    pub coarse: f64,
    /// Bytes that training may take on the device.
    pub memory_limit: Option<u64>,
    /// Whether the report says where the device's time went.
    pub timings: bool,
    /// How accurately training computes.
    pub numerics: Numerics,
}

/// Trains and writes the run folder.
///
/// # Errors
/// [`RunError`]; files of an earlier run stay as they were until training is done.
pub fn fit(
    options: &FitOptions,
    observe: &mut Observer<'_>,
) -> Result<(RunFolder, Report), RunError> {
    let begun = Instant::now();
    let gpu = open_gpu(options.timings)?;
    let preset = choose_preset(options, &gpu, observe);
    let amounts = preset.amounts();
    let load = preset.load_options(&options.load, &options.overrules);
    let scene = Scene::load(&options.colmap_dir, &load, observe)?;
    let iterations = options.iterations.unwrap_or(amounts.iterations);
    let room = Room {
        iterations,
        ..amounts.room()
    };
    let plan = scene.plan(room, &options.overrules);
    observe(Event::Note(plan.to_string()));
    let mut settings = LumaSettings {
        memory_limit: options.memory_limit,
        sh_degree: plan.sh_degree,
        robust: plan.has(Effect::Robust),
        antialiased: plan.has(Effect::Antialias),
        background: plan.has(Effect::Background),
        max_splats: options.max_splats.unwrap_or(amounts.max_splats),
        seed: options.seed,
        numerics: options.numerics,
        ..LumaSettings::new(iterations)
    };
    if options.densification == Densification::Relocate {
        settings = settings.relocating();
    }
    settings.schedule.coarse_until =
        (options.coarse * settings.schedule.iterations as f64) as usize;
    let ignores = plan.has(Effect::Masks) || plan.has(Effect::Robust);
    let cameras = scene.split.train.iter().map(|&i| &scene.photos[i].1);
    let demand = Demand::of(cameras, ignores, settings.sh_degree, options.memory_limit);
    let fits = demand.largest_set(options.memory_limit, gpu.binding_limit());
    if fits == 0 {
        return Err(RunError::Gpu(GpuError::OverLimit {
            splats: 1,
            needed: demand.peak_bytes(1),
            limit: options.memory_limit.unwrap_or(gpu.binding_limit()),
        }));
    }
    if fits < settings.max_splats {
        observe(Event::Note(match options.memory_limit {
            Some(limit) => format!("at most {fits} Gaussians fit into {} MiB", limit >> 20),
            None => format!("at most {fits} Gaussians fit into the adapter's bindings"),
        }));
        settings.max_splats = fits;
    }
    let start = first_splats(options, &scene, &settings, observe)?;
    let folder = match &options.output {
        Some(path) => RunFolder::at(path),
        None => RunFolder::for_capture(&options.colmap_dir),
    };
    files::make_folder(folder.path())?;
    let raster = Arc::new(Raster::with(&gpu, settings.raster_options()));
    let load = begun.elapsed().as_secs_f64();

    let begun = Instant::now();
    let views = scene
        .split
        .train
        .iter()
        .map(|&i| {
            let (photo, camera) = &scene.photos[i];
            TrainingView {
                camera: camera.clone(),
                gray: photo.gray.clone(),
                mask: match scene.removes_masked() {
                    true => carve::unknown(photo),
                    false => photo.mask.clone().filter(|_| plan.has(Effect::Masks)),
                },
                exposure: plan.exposures[i],
            }
        })
        .collect();
    let mut trainer = LumaTrainer::new(
        raster.clone(),
        settings.clone(),
        scene.extent,
        &start,
        views,
    )?;
    let mut log = String::from("iteration,loss,splats,seconds,poisoned\n");
    let (mut last, mut peak_device_memory) = (None, None);
    trainer.train(&mut |progress| {
        // Writing to a string cannot fail.
        let _ = writeln!(
            log,
            "{},{:.6},{},{:.3},{}",
            progress.iteration, progress.loss, progress.splats, progress.seconds, progress.poisoned
        );
        observe(Event::Progress {
            stage: Stage::Luma,
            done: progress.iteration,
            total: settings.schedule.iterations,
            message: format!("loss {:.4}, {} splats", progress.loss, progress.splats),
        });
        last = Some(progress);
        peak_device_memory = peak_device_memory.max(gpu.allocated_bytes());
    })?;
    let mut splats = trainer.splats()?;
    if scene.removes_masked() {
        splats = carved(&scene, &splats);
    }
    let timings = (options.timings)
        .then(|| Ok::<_, RunError>(kernel_reports(&gpu.timings()?, &trainer.load())))
        .transpose()?;
    let train = begun.elapsed().as_secs_f64();

    let begun = Instant::now();
    let held_out_views = measure_luma(&raster, &scene, &splats, &plan.exposures)?;
    let report = Report {
        version: REPORT_VERSION,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        capture: capture_report(&options.colmap_dir, &scene),
        device: DeviceReport {
            name: gpu.describe(),
            backend: format!("{:?}", gpu.info().backend),
            software: gpu.is_software(),
        },
        preset: preset.name().to_owned(),
        seed: options.seed,
        effects: EffectReport::of(&plan.decisions),
        luma: LumaReport {
            iterations: settings.schedule.iterations,
            sh_degree: settings.sh_degree,
            max_splats: settings.max_splats,
            antialiased: settings.antialiased,
            numerics: settings.numerics,
            splats: splats.len(),
            poisoned: last.map_or(0, |progress| progress.poisoned),
            refused: last.map_or(0, |progress| progress.refused),
            loss: last.map_or(0.0, |progress| progress.loss),
            seconds: LumaSeconds {
                load,
                train,
                measure: begun.elapsed().as_secs_f64(),
            },
            peak_host_memory: files::peak_host_memory(),
            peak_device_memory,
            estimated_device_memory: demand.peak_bytes(splats.len()),
            exposures: exposures(&scene, &plan),
            held_out: mean_quality(&held_out_views),
            held_out_views,
            timings,
        },
        chroma: None,
    };
    // The old colours do not belong to the new geometry.
    for stale in [folder.color(), folder.chroma(), folder.contact_sheet()] {
        files::remove(&stale)?;
    }
    folder.forget_evaluation()?;
    let comments = comments(settings.raster_options());
    ply::write_ply(&folder.luma(), &splats, glam::DVec3::ZERO, &comments)?;
    files::write(&folder.log(), log.as_bytes())?;
    folder.write_report(&report)?;
    Ok((folder, report))
}

/// The device; with `timed`, its dispatches are.
pub(super) fn open_gpu(timed: bool) -> Result<Gpu, RunError> {
    let gpu = Gpu::open()?;
    Ok(if timed { gpu.timed()? } else { gpu })
}

/// Comments in the header of every splat file; one says how it wants to be drawn.
pub(super) fn comments(options: RasterOptions) -> Vec<String> {
    let program = format!("gs-chroma {}", env!("CARGO_PKG_VERSION"));
    let mode = options.antialiased.then(|| ply::ANTIALIASED.to_owned());
    std::iter::once(program).chain(mode).collect()
}

fn choose_preset(options: &FitOptions, gpu: &Gpu, observe: &mut Observer<'_>) -> Preset {
    options.preset.unwrap_or_else(|| {
        if gpu.is_software() {
            observe(Event::Note(format!(
                "{} has no GPU behind it: preset draft (--preset paper overrules)",
                gpu.info().name
            )));
        }
        Preset::for_device(gpu)
    })
}

fn first_splats(
    options: &FitOptions,
    scene: &Scene,
    settings: &LumaSettings,
    observe: &mut Observer<'_>,
) -> Result<Splats, RunError> {
    let Some(path) = &options.init else {
        let points: Vec<_> = scene
            .capture
            .points
            .iter()
            .map(|point| {
                let rgb = point.color.map(|v| f64::from(v) / 255.0);
                (
                    point.position.as_vec3().to_array(),
                    gray_from_rgb(rgb) as f32,
                )
            })
            .collect();
        let mut splats = initial_splats(&points, scene.extent as f32, settings.sh_degree);
        if scene.removes_masked() {
            splats = carved(scene, &splats);
        }
        let dome = settings.background.then(|| background(scene, settings));
        let taken = dome.as_ref().map_or(0, Splats::len);
        truncate(&mut splats, settings.max_splats - taken);
        dome.into_iter().for_each(|dome| splats.append(dome));
        return Ok(splats);
    };
    let (splats, options) = read_splats(path, scene.capture.offset, observe)?;
    if options != settings.raster_options() {
        let [is, is_not] = ["antialiased", "not antialiased"];
        let (file, run) = if options.antialiased {
            (is, is_not)
        } else {
            (is_not, is)
        };
        observe(Event::Note(format!(
            "{} was trained {file}, this run is {run}: small Gaussians will have to adapt",
            path.display()
        )));
    }
    let mut splats = splats.to_luma();
    splats.sh = at_degree(&splats.sh, splats.means.len(), settings.sh_degree);
    truncate(&mut splats, settings.max_splats);
    Ok(splats)
}

/// Gaussians for what no point explains, at most a quarter of all that there may be.
fn background(scene: &Scene, settings: &LumaSettings) -> Splats {
    let most = settings.max_splats / 4;
    Backdrop::of(&scene.capture, &scene.photos, &scene.split.train).dome(most, settings.sh_degree)
}

/// The field cut or filled up with zeros to another degree.
fn at_degree(field: &ShField, count: usize, degree: u32) -> ShField {
    let mut out = ShField::zeros(count, degree, field.channels);
    let stride = sh::coefficient_count(degree) * field.channels;
    for i in 0..count {
        let from = field.of(i);
        let shared = from.len().min(stride);
        out.coefficients[i * stride..i * stride + shared].copy_from_slice(&from[..shared]);
    }
    out
}

/// Keeps an evenly spread choice of at most `max` Gaussians: a cap is a cap.
fn truncate(splats: &mut Splats, max: usize) {
    let count = splats.len();
    if count <= max {
        return;
    }
    let kept: Vec<usize> = (0..max).map(|k| k * count / max).collect();
    *splats = carve::chosen(splats, &kept);
}

fn measure_luma(
    raster: &Arc<Raster>,
    scene: &Scene,
    splats: &Splats,
    exposures: &[Exposure],
) -> Result<Vec<LumaView>, RunError> {
    let mut renderer = scene.renderer(raster, splats, &[&splats.sh])?;
    scene
        .split
        .test
        .iter()
        // A photo of which nothing counts says nothing.
        .filter(|&&i| (0..scene.photos[i].0.gray.len()).any(|p| counts(&scene.photos[i].0, p)))
        .map(|&i| {
            let (photo, camera) = &scene.photos[i];
            let picture = renderer.render(camera)?.remove(0);
            let shown: Vec<f32> = (picture.pixels.iter())
                .map(|&luma| exposures[i].shown(f64::from(luma)) as f32)
                .collect();
            let truth = gray_pixels(photo);
            Ok(LumaView {
                name: scene.capture.views[i].name.clone(),
                quality: luma_quality(photo, &shown, &truth),
            })
        })
        .collect()
}

/// What a report says about exposures: nothing where they are alike.
fn exposures(scene: &Scene, plan: &Plan) -> Vec<ViewExposure> {
    let all = scene.capture.views.iter().zip(&plan.exposures);
    all.filter(|_| plan.has(Effect::Exposure))
        .map(|(view, &exposure)| ViewExposure {
            name: view.name.clone(),
            exposure,
        })
        .collect()
}

/// Quality of the pixels that count.
fn luma_quality(photo: &Photo, shown: &[f32], truth: &[f32]) -> LumaQuality {
    let (width, height) = (photo.width as usize, photo.height as usize);
    let psnr = measure::psnr(&counted(photo, shown), &counted(photo, truth));
    // Where a pixel does not count the picture is taken to be right, and the others
    // answer for all that is wrong.
    let pixels = 0..truth.len();
    let patched: Vec<f32> = pixels
        .map(|p| if counts(photo, p) { shown[p] } else { truth[p] })
        .collect();
    let share = counted(photo, truth).len() as f64 / truth.len() as f64;
    LumaQuality {
        psnr: psnr.min(IDENTICAL_PSNR),
        ssim: 1.0 - (1.0 - measure::ssim(width, height, &patched, truth)) / share,
    }
}

fn mean_quality(views: &[LumaView]) -> Option<LumaQuality> {
    let mean = |value: fn(&LumaQuality) -> f64| {
        views.iter().map(|view| value(&view.quality)).sum::<f64>() / views.len() as f64
    };
    (!views.is_empty()).then(|| LumaQuality {
        psnr: mean(|quality| quality.psnr),
        ssim: mean(|quality| quality.ssim),
    })
}

/// What a report says about the photos.
pub(super) fn capture_report(colmap_dir: &Path, scene: &Scene) -> CaptureReport {
    let capture = &scene.capture;
    let path = std::fs::canonicalize(colmap_dir).unwrap_or_else(|_| colmap_dir.to_owned());
    CaptureReport {
        path: path.to_string_lossy().into_owned(),
        views: capture.views.len(),
        train: scene.split.train.len(),
        test: scene.split.test.len(),
        points: capture.points.len(),
        rejected: capture
            .rejected
            .iter()
            .map(|rejected| format!("{}: {}", rejected.name, rejected.reason))
            .collect(),
        load: scene.options.clone(),
        masked_views: scene.masked_views,
        not_finite: scene.not_finite,
        extent: scene.extent,
        offset: capture.offset.to_array(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(count: usize, degree: u32) -> Splats {
        let mut splats = Splats {
            means: (0..count).map(|i| [i as f32; 3]).collect(),
            quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
            log_scales: (0..count).map(|i| [-(i as f32); 3]).collect(),
            opacity_logits: (0..count).map(|i| i as f32).collect(),
            sh: ShField::zeros(count, degree, 1),
        };
        for (k, c) in splats.sh.coefficients.iter_mut().enumerate() {
            *c = k as f32;
        }
        splats
    }

    #[test]
    fn a_cap_is_a_cap_for_the_first_gaussians_too() {
        let mut splats = numbered(10, 1);
        truncate(&mut splats, 4);
        assert_eq!(splats.opacity_logits, [0.0, 2.0, 5.0, 7.0]);
        assert_eq!(splats.means[3], [7.0; 3]);
        assert_eq!(splats.sh.of(2), [20.0, 21.0, 22.0, 23.0]);
        let before = splats.clone();
        truncate(&mut splats, 4);
        assert_eq!(splats, before);
    }

    #[test]
    fn harmonics_change_degree_without_moving() {
        let splats = numbered(2, 1);
        assert_eq!(at_degree(&splats.sh, 2, 0).coefficients, [0.0, 4.0]);
        let raised = at_degree(&splats.sh, 2, 2);
        assert_eq!(raised.of(1)[..5], [4.0, 5.0, 6.0, 7.0, 0.0]);
        assert_eq!(raised.of(1).len(), 9);
    }
}
