/// `shaders/adam.wgsl`.
pub const ADAM: &str = include_str!("adam.wgsl");

/// `shaders/chroma_loss.wgsl`.
pub const CHROMA_LOSS: &str = include_str!("chroma_loss.wgsl");

/// `shaders/compact.wgsl`.
pub const COMPACT: &str = include_str!("compact.wgsl");

/// `shaders/densify.wgsl`.
pub const DENSIFY: &str = include_str!("densify.wgsl");

/// `shaders/lab_loss.wgsl`.
pub const LAB_LOSS: &str = include_str!("lab_loss.wgsl");

/// `shaders/lbfgs.wgsl`.
pub const LBFGS: &str = include_str!("lbfgs.wgsl");

/// `shaders/project.wgsl`.
pub const PROJECT: &str = include_str!("project.wgsl");

/// `shaders/rgb_loss.wgsl`.
pub const RGB_LOSS: &str = include_str!("rgb_loss.wgsl");

/// `shaders/scan.wgsl`.
pub const SCAN: &str = include_str!("scan.wgsl");

/// `shaders/sort.wgsl`.
pub const SORT: &str = include_str!("sort.wgsl");

/// `shaders/sum_loss.wgsl`.
pub const SUM_LOSS: &str = include_str!("sum_loss.wgsl");

/// `shaders/tile_lists.wgsl`.
pub const TILE_LISTS: &str = include_str!("tile_lists.wgsl");

/// `shaders/tile_ranges.wgsl`.
pub const TILE_RANGES: &str = include_str!("tile_ranges.wgsl");

/// `shaders/view_correction.wgsl`.
pub const VIEW_CORRECTION: &str = include_str!("view_correction.wgsl");

/// `shaders/blend.wgsl` with luma.
pub const BLEND_LUMA: &str = include_str!("blend_luma.wgsl");

/// `shaders/blend.wgsl` with chroma.
pub const BLEND_CHROMA: &str = include_str!("blend_chroma.wgsl");

/// `shaders/blend.wgsl` with rgb.
pub const BLEND_RGB: &str = include_str!("blend_rgb.wgsl");

/// `shaders/shade.wgsl` with luma.
pub const SHADE_LUMA: &str = include_str!("shade_luma.wgsl");

/// `shaders/shade.wgsl` with chroma.
pub const SHADE_CHROMA: &str = include_str!("shade_chroma.wgsl");

/// `shaders/shade.wgsl` with rgb.
pub const SHADE_RGB: &str = include_str!("shade_rgb.wgsl");

/// `shaders/blend.wgsl` with luma, depth.
pub const BLEND_DEPTH: &str = include_str!("blend_depth.wgsl");

/// `shaders/chroma_loss.wgsl` with agreeing.
pub const CHROMA_LOSS_AGREEING: &str = include_str!("chroma_loss_agreeing.wgsl");

/// `shaders/lab_loss.wgsl` with agreeing.
pub const LAB_LOSS_AGREEING: &str = include_str!("lab_loss_agreeing.wgsl");

/// `shaders/blend_backward.wgsl` with luma, geometry.
pub const BLEND_BACKWARD_LUMA: &str = include_str!("blend_backward_luma.wgsl");

/// `shaders/blend_backward.wgsl` with figures.
pub const BLEND_BACKWARD_FIGURES: &str = include_str!("blend_backward_figures.wgsl");

/// `shaders/sum_instances.wgsl` with luma, geometry.
pub const SUM_INSTANCES_LUMA: &str = include_str!("sum_instances_luma.wgsl");

/// `shaders/sum_instances.wgsl` with figures.
pub const SUM_INSTANCES_FIGURES: &str = include_str!("sum_instances_figures.wgsl");

/// `shaders/shade_backward.wgsl` with luma, geometry.
pub const SHADE_BACKWARD_LUMA: &str = include_str!("shade_backward_luma.wgsl");

/// `shaders/shade_backward.wgsl` with chroma.
pub const SHADE_BACKWARD_CHROMA: &str = include_str!("shade_backward_chroma.wgsl");

/// `shaders/shade_backward.wgsl` with rgb.
pub const SHADE_BACKWARD_RGB: &str = include_str!("shade_backward_rgb.wgsl");

/// `shaders/project_backward.wgsl` with luma, geometry.
pub const PROJECT_BACKWARD: &str = include_str!("project_backward.wgsl");

/// `shaders/project_backward.wgsl` with luma, geometry, step.
pub const PROJECT_BACKWARD_STEP: &str = include_str!("project_backward_step.wgsl");

/// `shaders/shade_backward.wgsl` with luma, geometry, step.
pub const SHADE_BACKWARD_STEP: &str = include_str!("shade_backward_step.wgsl");

/// `shaders/project_backward.wgsl` with luma, geometry, step, lazy.
pub const PROJECT_BACKWARD_STEP_LAZY: &str = include_str!("project_backward_step_lazy.wgsl");

/// `shaders/project_backward.wgsl` with luma, geometry, step, lazy, mip.
pub const PROJECT_BACKWARD_MIP_STEP_LAZY: &str = include_str!("project_backward_mip_step_lazy.wgsl");

/// `shaders/shade_backward.wgsl` with luma, geometry, step, lazy.
pub const SHADE_BACKWARD_STEP_LAZY: &str = include_str!("shade_backward_step_lazy.wgsl");

/// `shaders/blend_backward.wgsl` with luma, geometry, half.
pub const BLEND_BACKWARD_LUMA_HALF: &str = include_str!("blend_backward_luma_half.wgsl");

/// `shaders/sum_instances.wgsl` with luma, geometry, half.
pub const SUM_INSTANCES_LUMA_HALF: &str = include_str!("sum_instances_luma_half.wgsl");

/// `shaders/luma_loss.wgsl` with window11.
pub const LUMA_LOSS: &str = include_str!("luma_loss.wgsl");

/// `shaders/luma_loss.wgsl` with window7.
pub const LUMA_LOSS_WINDOW7: &str = include_str!("luma_loss_window7.wgsl");

/// `shaders/luma_loss.wgsl` with window5.
pub const LUMA_LOSS_WINDOW5: &str = include_str!("luma_loss_window5.wgsl");

/// `shaders/luma_loss.wgsl` with exposed, window11.
pub const LUMA_LOSS_EXPOSED: &str = include_str!("luma_loss_exposed.wgsl");

/// `shaders/luma_loss.wgsl` with exposed, window7.
pub const LUMA_LOSS_EXPOSED_WINDOW7: &str = include_str!("luma_loss_exposed_window7.wgsl");

/// `shaders/luma_loss.wgsl` with exposed, window5.
pub const LUMA_LOSS_EXPOSED_WINDOW5: &str = include_str!("luma_loss_exposed_window5.wgsl");

/// `shaders/luma_loss.wgsl` with masked, window11.
pub const LUMA_LOSS_MASKED: &str = include_str!("luma_loss_masked.wgsl");

/// `shaders/luma_loss.wgsl` with masked, window7.
pub const LUMA_LOSS_MASKED_WINDOW7: &str = include_str!("luma_loss_masked_window7.wgsl");

/// `shaders/luma_loss.wgsl` with masked, window5.
pub const LUMA_LOSS_MASKED_WINDOW5: &str = include_str!("luma_loss_masked_window5.wgsl");

/// `shaders/luma_loss.wgsl` with exposed, masked, window11.
pub const LUMA_LOSS_EXPOSED_MASKED: &str = include_str!("luma_loss_exposed_masked.wgsl");

/// `shaders/luma_loss.wgsl` with exposed, masked, window7.
pub const LUMA_LOSS_EXPOSED_MASKED_WINDOW7: &str = include_str!("luma_loss_exposed_masked_window7.wgsl");

/// `shaders/luma_loss.wgsl` with exposed, masked, window5.
pub const LUMA_LOSS_EXPOSED_MASKED_WINDOW5: &str = include_str!("luma_loss_exposed_masked_window5.wgsl");

/// `shaders/project.wgsl` with mip.
pub const PROJECT_MIP: &str = include_str!("project_mip.wgsl");

/// `shaders/project_backward.wgsl` with luma, geometry, mip.
pub const PROJECT_BACKWARD_MIP: &str = include_str!("project_backward_mip.wgsl");

/// `shaders/project_backward.wgsl` with luma, geometry, mip, step.
pub const PROJECT_BACKWARD_MIP_STEP: &str = include_str!("project_backward_mip_step.wgsl");

/// `shaders/blend_backward.wgsl` with rgb, geometry.
pub const BLEND_BACKWARD_RGB: &str = include_str!("blend_backward_rgb.wgsl");

/// `shaders/sum_instances.wgsl` with rgb, geometry.
pub const SUM_INSTANCES_RGB: &str = include_str!("sum_instances_rgb.wgsl");

/// `shaders/shade_backward.wgsl` with rgb, geometry, step.
pub const SHADE_BACKWARD_RGB_STEP: &str = include_str!("shade_backward_rgb_step.wgsl");

/// `shaders/project_backward.wgsl` with rgb, geometry, step.
pub const PROJECT_BACKWARD_RGB_STEP: &str = include_str!("project_backward_rgb_step.wgsl");

/// `shaders/blend_backward.wgsl` with rgb, geometry, playcanvas.
pub const BLEND_BACKWARD_RGB_PLAYCANVAS: &str = include_str!("blend_backward_rgb_playcanvas.wgsl");

/// `shaders/sum_instances.wgsl` with rgb, geometry, playcanvas.
pub const SUM_INSTANCES_RGB_PLAYCANVAS: &str = include_str!("sum_instances_rgb_playcanvas.wgsl");

/// `shaders/shade_backward.wgsl` with rgb, geometry, step, playcanvas.
pub const SHADE_BACKWARD_RGB_STEP_PLAYCANVAS: &str = include_str!("shade_backward_rgb_step_playcanvas.wgsl");

/// `shaders/project_backward.wgsl` with rgb, geometry, step, playcanvas.
pub const PROJECT_BACKWARD_RGB_STEP_PLAYCANVAS: &str = include_str!("project_backward_rgb_step_playcanvas.wgsl");

/// `shaders/project.wgsl` with playcanvas.
pub const PROJECT_PLAYCANVAS: &str = include_str!("project_playcanvas.wgsl");

/// `shaders/blend.wgsl` with rgb, playcanvas.
pub const BLEND_RGB_PLAYCANVAS: &str = include_str!("blend_rgb_playcanvas.wgsl");

/// `shaders/scan.wgsl` with simd.
pub const SCAN_SIMD: &str = include_str!("scan_simd.wgsl");

/// `shaders/sort.wgsl` with simd.
pub const SORT_SIMD: &str = include_str!("sort_simd.wgsl");

/// `shaders/blend.wgsl` with luma, simd.
pub const BLEND_LUMA_SIMD: &str = include_str!("blend_luma_simd.wgsl");

/// `shaders/blend.wgsl` with chroma, simd.
pub const BLEND_CHROMA_SIMD: &str = include_str!("blend_chroma_simd.wgsl");

/// `shaders/blend.wgsl` with rgb, simd.
pub const BLEND_RGB_SIMD: &str = include_str!("blend_rgb_simd.wgsl");

/// `shaders/blend.wgsl` with luma, depth, simd.
pub const BLEND_DEPTH_SIMD: &str = include_str!("blend_depth_simd.wgsl");

/// `shaders/blend.wgsl` with rgb, playcanvas, simd.
pub const BLEND_RGB_PLAYCANVAS_SIMD: &str = include_str!("blend_rgb_playcanvas_simd.wgsl");

/// `shaders/blend_backward.wgsl` with luma, geometry, simd.
pub const BLEND_BACKWARD_LUMA_SIMD: &str = include_str!("blend_backward_luma_simd.wgsl");

/// `shaders/blend_backward.wgsl` with luma, geometry, half, simd.
pub const BLEND_BACKWARD_LUMA_HALF_SIMD: &str = include_str!("blend_backward_luma_half_simd.wgsl");

/// `shaders/blend_backward.wgsl` with figures, simd.
pub const BLEND_BACKWARD_FIGURES_SIMD: &str = include_str!("blend_backward_figures_simd.wgsl");

/// `shaders/blend_backward.wgsl` with rgb, geometry, simd.
pub const BLEND_BACKWARD_RGB_SIMD: &str = include_str!("blend_backward_rgb_simd.wgsl");

/// `shaders/blend_backward.wgsl` with rgb, geometry, playcanvas, simd.
pub const BLEND_BACKWARD_RGB_PLAYCANVAS_SIMD: &str = include_str!("blend_backward_rgb_playcanvas_simd.wgsl");

/// Every compiled kernel by name, for tests that reflect them.
pub const ALL: &[(&str, &str)] = &[("adam", ADAM), ("chroma_loss", CHROMA_LOSS), ("compact", COMPACT), ("densify", DENSIFY), ("lab_loss", LAB_LOSS), ("lbfgs", LBFGS), ("project", PROJECT), ("rgb_loss", RGB_LOSS), ("scan", SCAN), ("sort", SORT), ("sum_loss", SUM_LOSS), ("tile_lists", TILE_LISTS), ("tile_ranges", TILE_RANGES), ("view_correction", VIEW_CORRECTION), ("blend_luma", BLEND_LUMA), ("blend_chroma", BLEND_CHROMA), ("blend_rgb", BLEND_RGB), ("shade_luma", SHADE_LUMA), ("shade_chroma", SHADE_CHROMA), ("shade_rgb", SHADE_RGB), ("blend_depth", BLEND_DEPTH), ("chroma_loss_agreeing", CHROMA_LOSS_AGREEING), ("lab_loss_agreeing", LAB_LOSS_AGREEING), ("blend_backward_luma", BLEND_BACKWARD_LUMA), ("blend_backward_figures", BLEND_BACKWARD_FIGURES), ("sum_instances_luma", SUM_INSTANCES_LUMA), ("sum_instances_figures", SUM_INSTANCES_FIGURES), ("shade_backward_luma", SHADE_BACKWARD_LUMA), ("shade_backward_chroma", SHADE_BACKWARD_CHROMA), ("shade_backward_rgb", SHADE_BACKWARD_RGB), ("project_backward", PROJECT_BACKWARD), ("project_backward_step", PROJECT_BACKWARD_STEP), ("shade_backward_step", SHADE_BACKWARD_STEP), ("project_backward_step_lazy", PROJECT_BACKWARD_STEP_LAZY), ("project_backward_mip_step_lazy", PROJECT_BACKWARD_MIP_STEP_LAZY), ("shade_backward_step_lazy", SHADE_BACKWARD_STEP_LAZY), ("blend_backward_luma_half", BLEND_BACKWARD_LUMA_HALF), ("sum_instances_luma_half", SUM_INSTANCES_LUMA_HALF), ("luma_loss", LUMA_LOSS), ("luma_loss_window7", LUMA_LOSS_WINDOW7), ("luma_loss_window5", LUMA_LOSS_WINDOW5), ("luma_loss_exposed", LUMA_LOSS_EXPOSED), ("luma_loss_exposed_window7", LUMA_LOSS_EXPOSED_WINDOW7), ("luma_loss_exposed_window5", LUMA_LOSS_EXPOSED_WINDOW5), ("luma_loss_masked", LUMA_LOSS_MASKED), ("luma_loss_masked_window7", LUMA_LOSS_MASKED_WINDOW7), ("luma_loss_masked_window5", LUMA_LOSS_MASKED_WINDOW5), ("luma_loss_exposed_masked", LUMA_LOSS_EXPOSED_MASKED), ("luma_loss_exposed_masked_window7", LUMA_LOSS_EXPOSED_MASKED_WINDOW7), ("luma_loss_exposed_masked_window5", LUMA_LOSS_EXPOSED_MASKED_WINDOW5), ("project_mip", PROJECT_MIP), ("project_backward_mip", PROJECT_BACKWARD_MIP), ("project_backward_mip_step", PROJECT_BACKWARD_MIP_STEP), ("blend_backward_rgb", BLEND_BACKWARD_RGB), ("sum_instances_rgb", SUM_INSTANCES_RGB), ("shade_backward_rgb_step", SHADE_BACKWARD_RGB_STEP), ("project_backward_rgb_step", PROJECT_BACKWARD_RGB_STEP), ("blend_backward_rgb_playcanvas", BLEND_BACKWARD_RGB_PLAYCANVAS), ("sum_instances_rgb_playcanvas", SUM_INSTANCES_RGB_PLAYCANVAS), ("shade_backward_rgb_step_playcanvas", SHADE_BACKWARD_RGB_STEP_PLAYCANVAS), ("project_backward_rgb_step_playcanvas", PROJECT_BACKWARD_RGB_STEP_PLAYCANVAS), ("project_playcanvas", PROJECT_PLAYCANVAS), ("blend_rgb_playcanvas", BLEND_RGB_PLAYCANVAS), ("scan_simd", SCAN_SIMD), ("sort_simd", SORT_SIMD), ("blend_luma_simd", BLEND_LUMA_SIMD), ("blend_chroma_simd", BLEND_CHROMA_SIMD), ("blend_rgb_simd", BLEND_RGB_SIMD), ("blend_depth_simd", BLEND_DEPTH_SIMD), ("blend_rgb_playcanvas_simd", BLEND_RGB_PLAYCANVAS_SIMD), ("blend_backward_luma_simd", BLEND_BACKWARD_LUMA_SIMD), ("blend_backward_luma_half_simd", BLEND_BACKWARD_LUMA_HALF_SIMD), ("blend_backward_figures_simd", BLEND_BACKWARD_FIGURES_SIMD), ("blend_backward_rgb_simd", BLEND_BACKWARD_RGB_SIMD), ("blend_backward_rgb_playcanvas_simd", BLEND_BACKWARD_RGB_PLAYCANVAS_SIMD), ];
