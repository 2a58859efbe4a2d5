//! Meshes of triangles: their files, points on them, pictures with exact maps.

use crate::camera;
use crate::device::Device;
use crate::error::{call, Result};
use crate::image::ImageViewMut;
use crate::object::object;
use crate::text::{array, c_optional, c_optional_path, c_path, count, pointer, text, zeros};
use crate::values::{
    Camera, MeshBackground, MeshFileDesc, MeshFlags, MeshInfo, MeshProtocol, MeshRenderDesc,
    MeshSize, MeshViewsFlags,
};
use splat_sys as sys;
use std::path::Path;

/// The arrays of a new mesh, row-major.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshDesc<'a> {
    /// [`MeshFlags::SINGLE_SIDED`]
    pub flags: MeshFlags,
    /// `[n,3]`
    pub vertices: Option<&'a [f64]>,
    /// `[m,3]` numbers of vertices
    pub triangles: Option<&'a [u32]>,
    /// `[n,3]`, of any lengths; None: those of the faces
    pub normals: Option<&'a [f32]>,
    /// `[n,2]`, v from the top down
    pub texcoords: Option<&'a [f32]>,
    /// `[n,4]` RGBA, linear
    pub colors: Option<&'a [f32]>,
    /// `[height,width,4]` sRGB and opacity, repeated
    pub texture: Option<&'a [u8]>,
    /// Width and height of the texture.
    pub texture_size: [u32; 2],
    /// Linear RGB and opacity, which multiply all others; all 0: 1.
    pub base_color: [f32; 4],
}

/// Where the maps of a view go; None: not wanted.
#[derive(Debug, Default, PartialEq)]
pub struct MeshMaps<'a> {
    /// 3 channels over the background, or 4 with alpha.
    pub color: Option<ImageViewMut<'a>>,
    /// The base colour without light, in the same way.
    pub albedo: Option<ImageViewMut<'a>>,
    /// 1 channel; the share of the pixel's samples that see the mesh.
    pub mask: Option<ImageViewMut<'a>>,
    /// 1 channel of floats; 0: nothing.
    pub depth: Option<ImageViewMut<'a>>,
    /// 3 channels of floats; 0: nothing.
    pub normal: Option<ImageViewMut<'a>>,
}

impl MeshMaps<'_> {
    fn to_raw(&self) -> sys::splat_mesh_maps {
        let raw = |map: &Option<ImageViewMut<'_>>| {
            map.as_ref().map_or_else(sys::splat_image::default, |view| view.to_raw())
        };
        sys::splat_mesh_maps {
            color: raw(&self.color),
            albedo: raw(&self.albedo),
            mask: raw(&self.mask),
            depth: raw(&self.depth),
            normal: raw(&self.normal),
        }
    }
}

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
    fn with_raw(
        &self,
        use_it: impl FnOnce(&sys::splat_mesh_views_desc) -> Result<()>,
    ) -> Result<()> {
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

object! {
    /// A surface of triangles in host memory, in the units and axes of its file. Needs no device.
    Mesh, splat_mesh, splat_mesh_destroy
}

// SAFETY: mesh.h: a mesh is thread-safe.
unsafe impl Send for Mesh {}
// SAFETY: mesh.h: a mesh is thread-safe.
unsafe impl Sync for Mesh {}

impl Mesh {
    /// Create a mesh of arrays, which are copied.
    ///
    /// ```
    /// use splat::prelude::*;
    /// let mesh = Mesh::create(&MeshDesc {
    ///     vertices: Some(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    ///     triangles: Some(&[0, 1, 2]),
    ///     ..Default::default()
    /// })?;
    /// mesh.normalise(MeshSize::UNIT_CUBE)?;
    /// assert_eq!(mesh.get_info()?.area, 0.25);
    /// # Ok::<(), splat::Error>(())
    /// ```
    /// # Errors
    /// `InvalidArgument` (lengths that do not fit together, a triangle of no vertex, a vertex that is
    /// not finite).
    pub fn create(desc: &MeshDesc<'_>) -> Result<Mesh> {
        let (vertices, vertex_count) = array("vertices", desc.vertices)?;
        let (triangles, triangle_count) = array("triangles", desc.triangles)?;
        let (normals, normal_count) = array("normals", desc.normals)?;
        let (texcoords, texcoord_count) = array("texcoords", desc.texcoords)?;
        let (colors, color_count) = array("colors", desc.colors)?;
        let (texture, texture_count) = array("texture", desc.texture)?;
        let raw = sys::splat_mesh_desc {
            flags: desc.flags.0,
            vertices,
            vertex_count,
            triangles,
            triangle_count,
            normals,
            normal_count,
            texcoords,
            texcoord_count,
            colors,
            color_count,
            texture,
            texture_count,
            texture_width: desc.texture_size[0],
            texture_height: desc.texture_size[1],
            base_color: desc.base_color,
            ..Default::default()
        };
        Mesh::made(|handle| call!(splat_mesh_create(&raw, handle)))
    }

    /// Read a .obj, .glb or .gltf file with its materials and textures.
    /// # Errors
    /// `NotFound`, `Io`, `Format` (damaged, or without faces), `Unsupported`, `InvalidArgument`.
    pub fn load(path: impl AsRef<Path>, desc: &MeshFileDesc) -> Result<Mesh> {
        let path = c_path("path", path.as_ref())?;
        Mesh::made(|handle| call!(splat_mesh_load(path.as_ptr(), &desc.to_raw(), handle)))
    }

    /// JSON: what was left out of the mesh's file.
    /// # Errors
    /// Another version of the library.
    pub fn load_report(&self) -> Result<String> {
        // SAFETY: the buffer lives through the call.
        text(|buffer, capacity, needed| unsafe {
            sys::splat_mesh_load_report(self.handle, buffer, capacity, needed)
        })
    }

    /// Counts, bounds, area, memory.
    /// # Errors
    /// Another version of the library.
    pub fn get_info(&self) -> Result<MeshInfo> {
        let mut info = sys::splat_mesh_info::default();
        call!(splat_mesh_get_info(self.handle, &mut info))?;
        Ok(MeshInfo::from_raw(&info))
    }

    /// Put the centre of the box into the origin, and make the mesh so large.
    /// # Errors
    /// `InvalidArgument` (the size, a mesh without extent).
    pub fn normalise(&self, size: MeshSize) -> Result<()> {
        call!(splat_mesh_normalise(self.handle, size.0))
    }

    /// `points` points on the surface, uniform by area: x, y, z of each.
    /// # Errors
    /// `InvalidArgument` (a mesh without area).
    pub fn sample(&self, points: usize, seed: u64) -> Result<Vec<f32>> {
        let mut found = zeros("points", &[points, 3])?;
        let length = found.len() as u64;
        call!(splat_mesh_sample(self.handle, seed, found.as_mut_ptr(), length))?;
        Ok(found)
    }

    /// Draw views, each into the maps of its place. Depth and normals are exact, at the centres of
    /// pixels.
    /// # Errors
    /// `InvalidArgument` (another number of maps than cameras, a camera, a field of `desc`, no map),
    /// `ShapeMismatch` (a map of another size or other channels), `Unsupported` (a mesh too large
    /// for the device), and of the device.
    pub fn render(
        &self,
        device: &Device,
        cameras: &[Camera],
        desc: &MeshRenderDesc,
        maps: &mut [MeshMaps<'_>],
    ) -> Result<()> {
        if maps.len() != cameras.len() {
            return Err(crate::error::Error::argument(format!(
                "maps: {} for {} cameras",
                maps.len(),
                cameras.len()
            )));
        }
        let raw: Vec<sys::splat_mesh_maps> = maps.iter().map(MeshMaps::to_raw).collect();
        call!(splat_mesh_render(
            self.handle,
            device.as_raw(),
            camera::raw(cameras),
            count("cameras", cameras.len())?,
            &desc.to_raw(),
            raw.as_ptr()
        ))
    }

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
        desc.with_raw(|raw| call!(splat_mesh_write_views(self.handle, device.as_raw(), raw)))
    }
}
