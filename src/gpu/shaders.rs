//! The WGSL of every kernel, compiled from `shaders/` by `build.rs`.

macro_rules! shaders {
    ($($(#[$doc:meta])* $name:ident = $file:literal;)*) => {
        $($(#[$doc])* pub const $name: &str = include_str!(concat!(env!("OUT_DIR"), "/", $file, ".wgsl"));)*

        /// Every compiled kernel by file name, for tests that reflect them.
        pub const ALL: &[(&str, &str)] = &[$(($file, $name)),*];
    };
}

shaders! {
    /// Adam.
    ADAM = "adam";
    /// Chroma loss.
    CHROMA_LOSS = "chroma_loss";
    /// Chroma loss with the agreement with a coarser scale.
    CHROMA_LOSS_AGREEING = "chroma_loss_agreeing";
    /// Keys of the depth sort.
    COMPACT = "compact";
    /// Copies along a densification plan.
    DENSIFY = "densify";
    /// L-BFGS.
    LBFGS = "lbfgs";
    /// Luma loss.
    LUMA_LOSS = "luma_loss";
    /// Luma loss of photos with exposures.
    LUMA_LOSS_EXPOSED = "luma_loss_exposed";
    /// Luma loss of photos with masks.
    LUMA_LOSS_MASKED = "luma_loss_masked";
    /// Luma loss with exposures and masks.
    LUMA_LOSS_EXPOSED_MASKED = "luma_loss_exposed_masked";
    /// Luma loss, SSIM over 7 × 7 pixels.
    LUMA_LOSS_WINDOW7 = "luma_loss_window7";
    /// Luma loss, SSIM over 5 × 5 pixels.
    LUMA_LOSS_WINDOW5 = "luma_loss_window5";
    /// Luma loss of photos with exposures, SSIM over 7 × 7 pixels.
    LUMA_LOSS_EXPOSED_WINDOW7 = "luma_loss_exposed_window7";
    /// Luma loss of photos with exposures, SSIM over 5 × 5 pixels.
    LUMA_LOSS_EXPOSED_WINDOW5 = "luma_loss_exposed_window5";
    /// Luma loss of photos with masks, SSIM over 7 × 7 pixels.
    LUMA_LOSS_MASKED_WINDOW7 = "luma_loss_masked_window7";
    /// Luma loss of photos with masks, SSIM over 5 × 5 pixels.
    LUMA_LOSS_MASKED_WINDOW5 = "luma_loss_masked_window5";
    /// Luma loss with exposures and masks, SSIM over 7 × 7 pixels.
    LUMA_LOSS_EXPOSED_MASKED_WINDOW7 = "luma_loss_exposed_masked_window7";
    /// Luma loss with exposures and masks, SSIM over 5 × 5 pixels.
    LUMA_LOSS_EXPOSED_MASKED_WINDOW5 = "luma_loss_exposed_masked_window5";
    /// Projection.
    PROJECT = "project";
    /// Adjoint of the projection.
    PROJECT_BACKWARD = "project_backward";
    /// Adjoint of the projection, with Adam's step.
    PROJECT_BACKWARD_STEP = "project_backward_step";
    /// Projection, antialiased.
    PROJECT_MIP = "project_mip";
    /// Adjoint of the projection, antialiased.
    PROJECT_BACKWARD_MIP = "project_backward_mip";
    /// Adjoint of the projection, antialiased, with Adam's step.
    PROJECT_BACKWARD_MIP_STEP = "project_backward_mip_step";
    /// Adjoint of the projection, with Adam's step for what the view shows.
    PROJECT_BACKWARD_STEP_LAZY = "project_backward_step_lazy";
    /// Adjoint of the projection, antialiased, with Adam's step for what the view shows.
    PROJECT_BACKWARD_MIP_STEP_LAZY = "project_backward_mip_step_lazy";
    /// What densification by relocation adds to a step.
    RELOCATION = "relocation";
    /// RGB loss.
    RGB_LOSS = "rgb_loss";
    /// Prefix sum.
    SCAN = "scan";
    /// Radix sort.
    SORT = "sort";
    /// Sum of the blocks' losses.
    SUM_LOSS = "sum_loss";
    /// Tile lists.
    TILE_LISTS = "tile_lists";
    /// Tile ranges.
    TILE_RANGES = "tile_ranges";
    /// Corrections of the views' teachers.
    VIEW_CORRECTION = "view_correction";
    /// Blending of luma.
    BLEND_LUMA = "blend_luma";
    /// Blending of chroma.
    BLEND_CHROMA = "blend_chroma";
    /// Blending of RGB.
    BLEND_RGB = "blend_rgb";
    /// Shading of luma.
    SHADE_LUMA = "shade_luma";
    /// Shading of chroma.
    SHADE_CHROMA = "shade_chroma";
    /// Shading of RGB.
    SHADE_RGB = "shade_rgb";
    /// Adjoint of blending, luma and geometry.
    BLEND_BACKWARD_LUMA = "blend_backward_luma";
    /// Adjoint of blending, luma and geometry, its records at half the size.
    BLEND_BACKWARD_LUMA_HALF = "blend_backward_luma_half";
    /// Adjoint of blending, gradient and curvature of color alone.
    BLEND_BACKWARD_FIGURES = "blend_backward_figures";
    /// Adjoint of shading, luma and means.
    SHADE_BACKWARD_LUMA = "shade_backward_luma";
    /// Adjoint of shading, luma and means, with Adam's step.
    SHADE_BACKWARD_STEP = "shade_backward_step";
    /// Adjoint of shading, luma and means, with Adam's step for what the view shows.
    SHADE_BACKWARD_STEP_LAZY = "shade_backward_step_lazy";
    /// Adjoint of shading, chroma alone, added to what is there.
    SHADE_BACKWARD_CHROMA = "shade_backward_chroma";
    /// Adjoint of shading, RGB alone, added to what is there.
    SHADE_BACKWARD_RGB = "shade_backward_rgb";
    /// Sum of the instances' gradients, luma and geometry.
    SUM_INSTANCES_LUMA = "sum_instances_luma";
    /// Sum of the instances' gradients, luma and geometry, of records at half the size.
    SUM_INSTANCES_LUMA_HALF = "sum_instances_luma_half";
    /// Sum of the instances' gradients and curvatures, color alone.
    SUM_INSTANCES_FIGURES = "sum_instances_figures";
}
