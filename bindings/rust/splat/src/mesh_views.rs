//! Meshes as objects of a data set.

use crate::device::Device;
use crate::error::{call, Result};
use crate::mesh::Mesh;
use crate::text::{c_optional, c_optional_path, pointer};
use crate::values::{MeshBackground, MeshProtocol, MeshViewsFlags};
use splat_sys as sys;
use std::path::Path;

/// An object of a data set, and what all its objects have in common; 0 is the default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshViewsDesc<'a> {
    /// The maps that are written besides pictures, and where is up.
    pub flags: MeshViewsFlags,
    /// The folder of the data set.
    pub path: Option<&'a Path>,
    /// "srn", "images"; None: srn.
    pub layout: Option<&'a str>,
    /// In names of folders; None: objects.
    pub category: Option<&'a str>,
    /// "train", "val", "test"; None: train.
    pub split: Option<&'a str>,
    /// Name of the object.
    pub name: Option<&'a str>,
    /// How meshes were made ready, in words that all objects of a folder must have in common.
    pub prepared: Option<&'a str>,
    /// With the name it decides all that is random.
    pub seed: u64,
    /// Side of the images, 8 to 2048; 0: 128.
    pub size: u32,
    /// Views of an object of train; 0: 50.
    pub train_views: u32,
    /// Views of an object of val and test; 0: 251.
    pub test_views: u32,
    /// Samples of a pixel's side: 1, 2, 4 or 8; 0: 4.
    pub samples: u32,
    /// Points on the surface; 0: none.
    pub points: u32,
    /// Where cameras stand.
    pub protocol: MeshProtocol,
    /// What is behind the object.
    pub background: MeshBackground,
    /// Distance of the cameras from the origin; 0: 1.3.
    pub distance: f64,
    /// Field of view, radians; 0: SRN's.
    pub fov_x: f64,
    /// Height of an orbit above the horizon, radians.
    pub elevation: f64,
    /// Radians: cameras roll, and aim beside the origin, by up to this angle.
    pub jitter: f64,
    /// Stops: objects are darker or brighter by up to this.
    pub exposure: f64,
}

impl MeshViewsDesc<'_> {
    /// Calls `use_it` with the struct of C.
    fn with_raw(&self, use_it: impl FnOnce(&sys::splat_mesh_views_desc) -> Result<()>) -> Result<()> {
        let path = c_optional_path("path", self.path)?;
        let layout = c_optional("layout", self.layout)?;
        let category = c_optional("category", self.category)?;
        let split = c_optional("split", self.split)?;
        let name = c_optional("name", self.name)?;
        let prepared = c_optional("prepared", self.prepared)?;
        use_it(&sys::splat_mesh_views_desc {
            flags: self.flags.0,
            path: pointer(&path),
            layout: pointer(&layout),
            category: pointer(&category),
            split: pointer(&split),
            name: pointer(&name),
            prepared: pointer(&prepared),
            seed: self.seed,
            size: self.size,
            train_views: self.train_views,
            test_views: self.test_views,
            samples: self.samples,
            points: self.points,
            protocol: self.protocol.0,
            background: self.background.0,
            distance: self.distance,
            fov_x: self.fov_x,
            elevation: self.elevation,
            jitter: self.jitter,
            exposure: self.exposure,
            ..Default::default()
        })
    }
}

/// True if the object is there already, so that its mesh need not be read.
/// # Errors
/// `InvalidArgument` (a field, a folder of data made with other values, an object that another split
/// has), `Unsupported` (a size above 2048), `Io`.
pub fn mesh_find_views(desc: &MeshViewsDesc<'_>) -> Result<bool> {
    let mut found = 0;
    desc.with_raw(|raw| call!(splat_mesh_find_views(raw, &mut found)))?;
    Ok(found != 0)
}

impl Mesh {
    /// Draw the mesh as an object of a data set. Its folder appears whole or not at all; one that is
    /// there is kept.
    ///
    /// ```
    /// use splat::prelude::*;
    /// # let corners = [-0.25, 0.0, -0.25, 0.25, 0.0, -0.25, 0.0, 0.0, 0.25];
    /// # let (vertices, triangles) = (Some(&corners[..]), Some(&[0, 1, 2][..]));
    /// # let mesh = Mesh::create(&MeshDesc { vertices, triangles, ..Default::default() })?;
    /// let folder = std::env::temp_dir().join(format!("splat_views_{}", std::process::id()));
    /// let desc = MeshViewsDesc {
    ///     path: Some(&folder),
    ///     name: Some("chair"),
    ///     flags: MeshViewsFlags::DEPTH | MeshViewsFlags::MASK,
    ///     size: 16,
    ///     train_views: 2,
    ///     ..Default::default()
    /// };
    /// mesh.write_views(&Device::create(&DeviceDesc::default())?, &desc)?;
    /// assert!(splat::mesh_find_views(&desc)?);
    /// # std::fs::remove_dir_all(&folder).unwrap();
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// As [`mesh_find_views`] and [`Mesh::render`]; `Format` (a mesh without area, or that no view
    /// shows), `NotFound`, `Io` (a file cannot be written).
    pub fn write_views(&self, device: &Device, desc: &MeshViewsDesc<'_>) -> Result<()> {
        desc.with_raw(|raw| call!(splat_mesh_write_views(self.as_raw(), device.as_raw(), raw)))
    }
}
