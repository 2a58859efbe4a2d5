//! Meshes of triangles: their files, points on them, pictures with exact maps.

use crate::camera;
use crate::device::Device;
use crate::error::{call, Result};
use crate::image::ImageViewMut;
use crate::object::object;
use crate::text::{array, c_path, count, text, zeros};
use crate::values::{Camera, MeshFileDesc, MeshFlags, MeshInfo, MeshRenderDesc, MeshSize};
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
}
