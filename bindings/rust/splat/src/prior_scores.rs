//! How good depth maps, normals and masks are, and points of shapes.
//!
//! Maps are images of one size; numbers that are not finite are refused, except where a mask leaves
//! them out. [`crate::Scene::compare_points`] compares a scene with points.

use crate::error::{call, Result};
use crate::image::{ImageView, ImageViewMut};
use crate::text::{c_path, zeros};
use crate::values::{
    Camera, DepthFlags, DepthScores, FidelityFlags, FidelityScores, MapFilter, MaskFlags,
    MaskScores, NormalFlags, NormalScores, PlaneScores,
};
use splat_sys as sys;
use std::path::Path;

/// Errors of a depth map after its alignment with the least squares.
///
/// `mask`: pixels > 0.5 count; None: those with a truth > 0.
///
/// ```
/// use splat::prelude::*;
/// let truth = ImageView::new(&[1.0_f32, 2.0, 3.0, 4.0], [2, 2], 1)?;
/// let half = ImageView::new(&[0.5_f32, 1.0, 1.5, 2.0], [2, 2], 1)?;
/// let scores = splat::prior_scores::compare_depth(half, truth, None, DepthFlags::empty())?;
/// assert!((scores.scale - 2.0).abs() < 1e-6);
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn compare_depth(
    prediction: ImageView,
    truth: ImageView,
    mask: Option<ImageView>,
    flags: DepthFlags,
) -> Result<DepthScores> {
    let mask = mask.map(ImageView::to_raw);
    let mut scores = sys::splat_depth_scores::default();
    call!(splat_prior_compare_depth(
        &prediction.to_raw(),
        &truth.to_raw(),
        mask.as_ref().map_or(std::ptr::null(), |mask| mask as *const _),
        flags.0,
        &mut scores
    ))?;
    Ok(DepthScores::from_raw(&scores))
}

/// Angles between normals, in degrees.
///
/// `mask`: pixels > 0.5 count; None: those with a true normal.
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn compare_normals(
    prediction: ImageView,
    truth: ImageView,
    mask: Option<ImageView>,
    flags: NormalFlags,
) -> Result<NormalScores> {
    let mask = mask.map(ImageView::to_raw);
    let mut scores = sys::splat_normal_scores::default();
    call!(splat_prior_compare_normals(
        &prediction.to_raw(),
        &truth.to_raw(),
        mask.as_ref().map_or(std::ptr::null(), |mask| mask as *const _),
        flags.0,
        &mut scores
    ))?;
    Ok(NormalScores::from_raw(&scores))
}

/// Covering, recall and precision of planes: maps of 4 channels, as [`crate::planes_from_depth`] fills them.
/// A plane is found if distances differ by `max_distance` and normals by `max_degrees` at most.
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn compare_planes(
    prediction: ImageView,
    truth: ImageView,
    flags: NormalFlags,
    max_distance: f64,
    max_degrees: f64,
) -> Result<PlaneScores> {
    let mut scores = sys::splat_plane_scores::default();
    call!(splat_prior_compare_planes(
        &prediction.to_raw(),
        &truth.to_raw(),
        flags.0,
        max_distance,
        max_degrees,
        &mut scores
    ))?;
    Ok(PlaneScores::from_raw(&scores))
}

/// Overlap of a soft mask with the true one.
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn compare_masks(
    prediction: ImageView,
    alpha: ImageView,
    flags: MaskFlags,
) -> Result<MaskScores> {
    let mut scores = sys::splat_mask_scores::default();
    call!(splat_prior_compare_masks(&prediction.to_raw(), &alpha.to_raw(), flags.0, &mut scores))?;
    Ok(MaskScores::from_raw(&scores))
}

/// Visual information fidelity of images in the pixel domain (Sheikh and Bovik 2006).
/// # Errors
/// `ShapeMismatch` (also below 41 pixels), `InvalidArgument`.
pub fn compare_fidelity(
    prediction: ImageView,
    truth: ImageView,
    flags: FidelityFlags,
) -> Result<FidelityScores> {
    let mut scores = sys::splat_fidelity_scores::default();
    call!(splat_prior_compare_images(&prediction.to_raw(), &truth.to_raw(), flags.0, &mut scores))?;
    Ok(FidelityScores::from_raw(&scores))
}

/// Edges of a map, or a mask without holes or specks, to a picture of the same size.
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn filter_map(map: ImageView, filter: MapFilter, filtered: ImageViewMut) -> Result<()> {
    let mut filtered = filtered.to_raw();
    call!(splat_prior_filter(&map.to_raw(), filter.0, &mut filtered))
}

/// `count` points on the surface of an OBJ file, uniform by area: x, y, z of each.
/// # Errors
/// `NotFound`, `Io`, `Format`, `Unsupported`, `InvalidArgument` (no area).
pub fn mesh_points(path: impl AsRef<Path>, count: usize, seed: u64) -> Result<Vec<f32>> {
    let path = c_path("path", path.as_ref())?;
    let mut points: Vec<f32> = zeros("count", &[3, count])?;
    call!(splat_points_from_mesh(path.as_ptr(), seed, points.as_mut_ptr(), points.len() as u64))?;
    Ok(points)
}

/// The points of the world that a depth map shows, x, y, z of each: distances along the camera's
/// axis, <= 0 where there is none.
/// # Errors
/// `ShapeMismatch`, `InvalidArgument`.
pub fn depth_points(depth: ImageView, camera: &Camera) -> Result<Vec<f32>> {
    let depth = depth.to_raw();
    let sizes = [3, depth.width as usize, depth.height as usize];
    let mut points: Vec<f32> = zeros("depth", &sizes)?;
    let mut needed = 0;
    call!(splat_points_from_depth(
        &depth,
        (camera as *const Camera).cast(),
        points.as_mut_ptr(),
        points.len() as u64,
        &mut needed
    ))?;
    points.truncate(needed as usize);
    Ok(points)
}
