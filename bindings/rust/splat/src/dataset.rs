//! Data sets.

use crate::error::{call, Result};
use crate::object::object;
use crate::text::{array_mut, c_optional, c_optional_path, count, pointer, text};
use crate::values::{Co3dFlags, Co3dInfo, DataFlags, TokensFlags, TokensInfo};
use splat_sys as sys;
use std::path::Path;

/// The name of an object as one part of a path, for files that are named after it: %XX for whatever
/// leads elsewhere or is forbidden on some system, at most 200 bytes.
/// # Errors
/// Another version of the library.
pub fn path_name(name: &str) -> Result<String> {
    let name = c_optional("name", Some(name))?;
    // SAFETY: name and buffer live through the call.
    text(|buffer, capacity, needed| unsafe {
        sys::splat_path_name(pointer(&name), buffer, capacity, needed)
    })
}

/// Which data set, and how its images are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DatasetDesc<'a> {
    /// Maps that are required; keep objects with missing files.
    pub flags: DataFlags,
    /// Folder of the data set.
    pub path: Option<&'a Path>,
    /// "store", "tables", "srn", "co3d", "nmr", "disn" (and its parts, "disn_easy", "disn_hard",
    /// "disn_albedo"), "objaverse", "gso", "images"; None: by the folder.
    pub format: Option<&'a str>,
    /// "train", "val", "test"; None: train.
    pub split: Option<&'a str>,
    /// "cars", "hydrants", where there are several; None: the only one.
    pub category: Option<&'a str>,
    /// The objects of "objaverse" in their order, a JSON array of names.
    pub objects_file: Option<&'a Path>,
    /// Names of sequences of "co3d" to leave out.
    pub excluded_file: Option<&'a Path>,
    /// Test objects of "nmr" and their source views.
    pub views_file: Option<&'a Path>,
    /// Side of the returned images, which are square; 0: as stored.
    pub resolution: u32,
    /// Use only this many objects, the first in order; 0: all.
    pub limit: u32,
    /// For decoded images; 0: 1 GiB.
    pub cache_bytes: u64,
    /// Behind transparent pixels, 0 to 1.
    pub background: [f32; 3],
}

/// Where [`Dataset::read`] writes n views of R x R pixels; None is not read.
#[derive(Debug, Default, PartialEq)]
pub struct DatasetViews<'a> {
    /// `[n,3,R,R]` 0 to 1
    pub images: Option<&'a mut [f32]>,
    /// `[n,1,R,R]` 0 to 1, larger is nearer
    pub depths: Option<&'a mut [f32]>,
    /// `[n,3,R,R]` 0 to 1
    pub normals: Option<&'a mut [f32]>,
    /// `[n,1,R,R]` 0 to 1
    pub masks: Option<&'a mut [f32]>,
    /// `[n,5,R,R]` 0 to 1: (normal + 1) / 2, distance and id of the pixel's plane; 0 without one
    pub planes: Option<&'a mut [f32]>,
    /// `[n,16]` row vectors, OpenCV axes; the world is the frame of the first view
    pub view_to_world: Option<&'a mut [f32]>,
    /// `[n,4]` w x y z of that rotation, w >= 0
    pub quaternions: Option<&'a mut [f32]>,
    /// `[n,2]` pixels at R
    pub focals: Option<&'a mut [f32]>,
    /// `[n]` of the origin along the absolute camera's axis (CO3D); else 0
    pub origin_distances: Option<&'a mut [f32]>,
}

object! {
    /// Objects seen by several cameras, stored in a folder; needs no device.
    Dataset, splat_dataset, splat_dataset_destroy
}

// SAFETY: data.h: a data set is thread-safe.
unsafe impl Send for Dataset {}
// SAFETY: data.h: a data set is thread-safe.
unsafe impl Sync for Dataset {}

impl Dataset {
    /// Open the data set in a folder.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let folder = std::env::temp_dir().join("splat_example");
    /// let desc = SyntheticDesc {
    ///     path: Some(&folder),
    ///     resolution: 16,
    ///     train_views: 2,
    ///     train_objects: 1,
    ///     ..Default::default()
    /// };
    /// splat::synthetic_write(&desc, 0)?;
    /// let dataset = Dataset::open(&DatasetDesc { path: Some(&folder), ..Default::default() })?;
    /// let mut images = vec![0.0; 2 * 3 * 16 * 16];
    /// let mut views = DatasetViews { images: Some(&mut images), ..Default::default() };
    /// dataset.read(0, &[0, 1], &mut views)?;
    /// # std::fs::remove_dir_all(&folder).unwrap();
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `NotFound` (folder, split, maps), `Io`, `Format`, `InvalidArgument`.
    pub fn open(desc: &DatasetDesc<'_>) -> Result<Dataset> {
        let path = c_optional_path("path", desc.path)?;
        let format = c_optional("format", desc.format)?;
        let split = c_optional("split", desc.split)?;
        let category = c_optional("category", desc.category)?;
        let objects_file = c_optional_path("objects_file", desc.objects_file)?;
        let excluded_file = c_optional_path("excluded_file", desc.excluded_file)?;
        let views_file = c_optional_path("views_file", desc.views_file)?;
        let raw = sys::splat_dataset_desc {
            flags: desc.flags.0,
            path: pointer(&path),
            format: pointer(&format),
            split: pointer(&split),
            category: pointer(&category),
            objects_file: pointer(&objects_file),
            excluded_file: pointer(&excluded_file),
            views_file: pointer(&views_file),
            resolution: desc.resolution,
            limit: desc.limit,
            cache_bytes: desc.cache_bytes,
            background: desc.background,
            ..Default::default()
        };
        Dataset::made(|handle| call!(splat_dataset_open(&raw, handle)))
    }

    /// JSON: format, split, objects, views, resolution, maps, names.
    /// # Errors
    /// Another version of the library.
    pub fn report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_dataset_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Read views of one object, in the given order.
    /// # Errors
    /// `InvalidArgument` (no such object or view, a slice that is too short), `NotFound`,
    /// `Io`, `Format`; after the last three, slices may be partly written.
    pub fn read(&self, object: u32, views: &[u32], out: &mut DatasetViews<'_>) -> Result<()> {
        let (images, image_count) = array_mut("images", out.images.as_deref_mut())?;
        let (depths, depth_count) = array_mut("depths", out.depths.as_deref_mut())?;
        let (normals, normal_count) = array_mut("normals", out.normals.as_deref_mut())?;
        let (masks, mask_count) = array_mut("masks", out.masks.as_deref_mut())?;
        let (planes, plane_count) = array_mut("planes", out.planes.as_deref_mut())?;
        let (view_to_world, view_to_world_count) =
            array_mut("view_to_world", out.view_to_world.as_deref_mut())?;
        let (quaternions, quaternion_count) =
            array_mut("quaternions", out.quaternions.as_deref_mut())?;
        let (focals, focal_count) = array_mut("focals", out.focals.as_deref_mut())?;
        let (origin_distances, origin_distance_count) =
            array_mut("origin_distances", out.origin_distances.as_deref_mut())?;
        let mut raw = sys::splat_dataset_views {
            images,
            depths,
            normals,
            masks,
            view_to_world,
            quaternions,
            focals,
            origin_distances,
            image_count,
            depth_count,
            normal_count,
            mask_count,
            view_to_world_count,
            quaternion_count,
            focal_count,
            origin_distance_count,
            planes,
            plane_count,
            ..Default::default()
        };
        let length = count("views", views.len())?;
        call!(splat_dataset_read(self.handle, object, views.as_ptr(), length, &mut raw))
    }

    /// JSON: check all files of one object.
    /// # Errors
    /// `InvalidArgument` (no such object).
    pub fn check(&self, object: u32) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_dataset_check(self.handle, object, buffer, capacity, needed)
        })
    }
}

/// Procedural objects with exact maps, in the layout of SRN's data.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SyntheticDesc<'a> {
    /// The folder to write to.
    pub path: Option<&'a Path>,
    /// "cars", "chairs", "mixed"; None: cars.
    pub category: Option<&'a str>,
    /// Seed of all random choices.
    pub seed: u64,
    /// 8 to 2048; 0: 128.
    pub resolution: u32,
    /// From random places around the object; 0: 50.
    pub train_views: u32,
    /// Views of val and test objects, on a spiral; 0: 251.
    pub test_views: u32,
    /// Objects of the split train.
    pub train_objects: u32,
    /// Objects of the split val.
    pub val_objects: u32,
    /// Objects of the split test.
    pub test_objects: u32,
}

/// Write one object, counted over all splits, train first. Several threads may write different
/// objects at once.
/// # Errors
/// `Unsupported` (resolution above 2048), `InvalidArgument` (no such object or category, a folder
/// with data made from other values), `NotFound`, `Io` (the folder or a file cannot be written),
/// `OutOfHostMemory`.
pub fn synthetic_write(desc: &SyntheticDesc<'_>, index: u32) -> Result<()> {
    let path = c_optional_path("path", desc.path)?;
    let category = c_optional("category", desc.category)?;
    let raw = sys::splat_synthetic_desc {
        path: pointer(&path),
        category: pointer(&category),
        seed: desc.seed,
        resolution: desc.resolution,
        train_views: desc.train_views,
        test_views: desc.test_views,
        train_objects: desc.train_objects,
        val_objects: desc.val_objects,
        test_objects: desc.test_objects,
        ..Default::default()
    };
    call!(splat_synthetic_write(&raw, index))
}

/// Which part of CO3D's raw release becomes a data set of the published code, and where.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Co3dDesc<'a> {
    /// The folder of the release.
    pub raw: Option<&'a Path>,
    /// The folder to write to.
    pub out: Option<&'a Path>,
    /// "hydrant", "teddybear".
    pub category: &'a str,
    /// None: "fewview_dev".
    pub subset: Option<&'a str>,
    /// "train", "val", "test"; None: train.
    pub split: Option<&'a str>,
    /// Side of the images; 0: 128.
    pub size: u32,
    /// Use only this many sequences; 0: all.
    pub limit: u32,
    /// Keep the release's cameras.
    pub flags: Co3dFlags,
}

/// Write the data set; sequences that are there are kept.
/// # Errors
/// `NotFound`, `Format` (the release), `Io`, `InvalidArgument`.
pub fn co3d_prepare(desc: &Co3dDesc<'_>) -> Result<Co3dInfo> {
    let raw = c_optional_path("raw", desc.raw)?;
    let out = c_optional_path("out", desc.out)?;
    let category = c_optional("category", Some(desc.category))?;
    let subset = c_optional("subset", desc.subset)?;
    let split = c_optional("split", desc.split)?;
    let given = sys::splat_co3d_desc {
        flags: desc.flags.0,
        raw: pointer(&raw),
        out: pointer(&out),
        category: pointer(&category),
        subset: pointer(&subset),
        split: pointer(&split),
        size: desc.size,
        limit: desc.limit,
        ..Default::default()
    };
    let mut info = sys::splat_co3d_info::default();
    call!(splat_co3d_prepare(&given, &mut info))?;
    Ok(Co3dInfo::from_raw(&info))
}

/// Which masks of classes and instances become tokens of the views of a data set, and where.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TokensDesc<'a> {
    /// The folder of the data set.
    pub data: Option<&'a Path>,
    /// None: detected.
    pub format: Option<&'a str>,
    /// Which of several in the folder; None: the only one.
    pub category: Option<&'a str>,
    /// SPLIT/OBJECT/ with a .png for each view; of a data set without splits OBJECT/.
    pub masks: Option<&'a Path>,
    /// .json: COCO's panoptic annotations; else a palette, lines "R G B name".
    pub names: Option<&'a Path>,
    /// .npz or .safetensors; an existing one is replaced.
    pub out: Option<&'a Path>,
    /// Numbers of a token, even, from 12; 0: 32, of vectors 60.
    pub dimension: u32,
    /// Tokens of a view; 0: 16.
    pub tokens: u32,
    /// One vector for each view instead.
    pub flags: TokensFlags,
}

/// Write tokens for `data.tokens_file`, or vectors for `data.embedding_file`.
/// # Errors
/// `NotFound`, `Format` (names, masks), `Io`, `Unsupported`, `InvalidArgument`.
pub fn tokens_write(desc: &TokensDesc<'_>) -> Result<TokensInfo> {
    let data = c_optional_path("data", desc.data)?;
    let format = c_optional("format", desc.format)?;
    let category = c_optional("category", desc.category)?;
    let masks = c_optional_path("masks", desc.masks)?;
    let names = c_optional_path("names", desc.names)?;
    let out = c_optional_path("out", desc.out)?;
    let given = sys::splat_tokens_desc {
        flags: desc.flags.0,
        data: pointer(&data),
        format: pointer(&format),
        category: pointer(&category),
        masks: pointer(&masks),
        names: pointer(&names),
        out: pointer(&out),
        dimension: desc.dimension,
        tokens: desc.tokens,
        ..Default::default()
    };
    let mut info = sys::splat_tokens_info::default();
    call!(splat_tokens_write(&given, &mut info))?;
    Ok(TokensInfo::from_raw(&info))
}
