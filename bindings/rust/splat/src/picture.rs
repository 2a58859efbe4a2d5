//! Pictures of objects, as predictors take them.

use crate::error::{call, Result};
use crate::image::{ImageView, ImageViewMut};
use crate::text::{array, c_path};
use crate::values::{PictureFlags, PictureInfo};
use splat_sys as sys;
use std::ffi::CString;
use std::path::Path;

/// A picture or a map: none, a file or pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PictureSource<'a> {
    /// Nothing is given.
    #[default]
    None,
    /// PNG, JPEG or WebP.
    Path(&'a Path),
    /// Reduced to 8 bits.
    Pixels(ImageView<'a>),
}

/// One view of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Picture<'a> {
    /// The picture itself.
    pub image: PictureSource<'a>,
    /// The object's mask; none: an alpha that is not opaque everywhere, else what differs from the
    /// colour of the border.
    pub mask: PictureSource<'a>,
    /// Where the network takes it; larger is nearer, or as model.head.depth_maps says, at any scale.
    pub depth: PictureSource<'a>,
    /// Where the network takes it; (normal + 1) / 2, in the camera's axes.
    pub normal: PictureSource<'a>,
    /// [`PictureFlags::WHOLE`]: use the largest centred square, not the object's.
    pub flags: PictureFlags,
    /// The object's longer side, as a part of the square's; 0: 0.65.
    pub foreground: f32,
    /// Pixels of the image; 0: by its Exif data, else not known.
    pub focal: f64,
    /// Along the camera's axis, where the network takes it; else 0.
    pub origin_distance: f64,
    /// Row-major; None for networks of one view.
    pub world_to_camera: Option<[f64; 16]>,
    /// A custom embedding.
    pub embedding: Option<&'a [f32]>,
    /// `[token_dim,tokens]` where the network takes them
    pub tokens: Option<&'a [f32]>,
}

impl<'a> Picture<'a> {
    /// A picture in a file.
    pub fn file<P: AsRef<Path> + ?Sized>(path: &'a P) -> Self {
        Picture { image: PictureSource::Path(path.as_ref()), ..Default::default() }
    }

    /// A picture in memory.
    #[must_use]
    pub fn pixels(image: ImageView<'a>) -> Self {
        Picture { image: PictureSource::Pixels(image), ..Default::default() }
    }
}

fn raw_source(
    argument: &str,
    source: PictureSource<'_>,
    paths: &mut Vec<CString>,
) -> Result<sys::splat_picture_source> {
    let mut raw = sys::splat_picture_source::default();
    match source {
        PictureSource::None => {}
        PictureSource::Path(path) => {
            let path = c_path(argument, path)?;
            raw.path = path.as_ptr();
            paths.push(path);
        }
        PictureSource::Pixels(image) => raw.pixels = image.to_raw(),
    }
    Ok(raw)
}

/// Pictures for C; the texts of their paths live as long.
pub(crate) struct RawPictures {
    pub(crate) list: Vec<sys::splat_picture>,
    _paths: Vec<CString>,
}

impl RawPictures {
    pub(crate) fn new(pictures: &[Picture<'_>]) -> Result<Self> {
        let (mut list, mut paths) = (Vec::new(), Vec::new());
        for picture in pictures {
            let (embedding, embedding_count) = array("embedding", picture.embedding)?;
            let (tokens, token_count) = array("tokens", picture.tokens)?;
            list.push(sys::splat_picture {
                image: raw_source("image", picture.image, &mut paths)?,
                mask: raw_source("mask", picture.mask, &mut paths)?,
                depth: raw_source("depth", picture.depth, &mut paths)?,
                normal: raw_source("normal", picture.normal, &mut paths)?,
                flags: picture.flags.0,
                foreground: picture.foreground,
                focal: picture.focal,
                origin_distance: picture.origin_distance,
                world_to_camera: picture.world_to_camera.unwrap_or_default(),
                embedding,
                embedding_count,
                tokens,
                token_count,
            });
        }
        Ok(RawPictures { list, _paths: paths })
    }
}

/// Where [`picture_cut`] writes: squares of `resolution` pixels. None is not wanted.
#[derive(Debug, Default, PartialEq)]
pub struct PictureCut<'a> {
    /// Pixels of a side.
    pub resolution: u32,
    /// Behind the object, 0 to 1.
    pub background: [f32; 3],
    /// 3 channels
    pub image: Option<ImageViewMut<'a>>,
    /// 1 channel
    pub mask: Option<ImageViewMut<'a>>,
    /// 1 channel; needs the picture's map; 0 outside of the object
    pub depth: Option<ImageViewMut<'a>>,
    /// 3 channels; needs the picture's map; 0.5 outside of the object
    pub normal: Option<ImageViewMut<'a>>,
}

/// Cut a picture and its maps out as a predictor does, without a device.
///
/// ```
/// use splat::prelude::*;
/// let mut pixels = vec![255_u8; 32 * 32 * 3];
/// pixels[3 * 500..][..90].fill(0);
/// let (mut image, view) = (Image::<u8>::new([16, 16], 3)?, ImageView::new(&pixels, [32, 32], 3)?);
/// let mut cut = PictureCut {
///     resolution: 16,
///     image: Some(image.view_mut()?),
///     ..Default::default()
/// };
/// let info = splat::picture_cut(&Picture::pixels(view), &mut cut)?;
/// assert_eq!((info.width, info.found), (32, Found::BY_BORDER));
/// # Ok::<(), splat::Error>(())
/// ```
/// # Errors
/// `InvalidArgument` (another count), `InvalidState` (the network's output is not finite: the
/// weights overflow), `OutOfHostMemory`, errors of the device.
pub fn picture_cut(picture: &Picture<'_>, out: &mut PictureCut<'_>) -> Result<PictureInfo> {
    let pictures = RawPictures::new(std::slice::from_ref(picture))?;
    let image = |view: &Option<ImageViewMut<'_>>| {
        view.as_ref().map_or_else(Default::default, |view| view.to_raw())
    };
    let raw = sys::splat_picture_cut_desc {
        resolution: out.resolution,
        background: out.background,
        image: image(&out.image),
        mask: image(&out.mask),
        depth: image(&out.depth),
        normal: image(&out.normal),
        ..Default::default()
    };
    let mut info = sys::splat_picture_info::default();
    call!(splat_picture_cut(pictures.list.as_ptr(), &raw, &mut info))?;
    Ok(PictureInfo::from_raw(&info))
}
