//! Textures: 8-bit sRGB pictures with a mip pyramid, sampled in linear light.

use glam::{Vec2, Vec3, Vec4};
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageResult};
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor};
use std::panic::catch_unwind;
use std::path::Path;
use std::sync::Arc;

use crate::memory;
use crate::panorama::{LINEAR, linear_to_code, opened};

pub(super) mod cutout;
mod wrap;

pub use wrap::Wrap;

use super::error::{MAX_SIDE, SceneError};

/// A picture that multiplies a material's albedo; v = 0 is its bottom row. Beyond its edges it goes on as its [`Wrap`]s say.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The picture's file name, for messages.
    pub name: String,
    levels: Vec<Level>,
    /// The file it was read from, if that is a PNG or JPEG picture: to be passed on as it is.
    file: Option<Arc<[u8]>>,
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    /// Rows from the top; the fourth byte is alpha, of the picture itself only.
    texels: Vec<[u8; 4]>,
    /// How the picture goes on across and down.
    wrap: [Wrap; 2],
    /// [`LINEAR`], without asking each time whether it is ready.
    linear: Arc<[f32; 256]>,
}

impl Texture {
    /// One white texel: what stands in where there is no picture, or nothing looks at it.
    pub(crate) fn blank() -> Self {
        Self::new(String::new(), 1, 1, vec![[255; 4]])
    }

    /// About the bytes that a picture would take, from its head alone; 0 where that says nothing.
    pub(super) fn bytes_of(path: &Path) -> u64 {
        let size = || {
            let mut file = BufReader::new(File::open(path).ok()?);
            let format = image::guess_format(file.fill_buf().ok()?).ok()?;
            Some(opened(file, format).ok()?.0.dimensions())
        };
        // the levels add a third
        size().map_or(0, |(width, height)| u64::from(width) * u64::from(height) * 4 * 4 / 3)
    }

    /// Reads an 8- or 16-bit sRGB picture; alpha counts for cut-outs only. `None` for a format that is not read.
    ///
    /// # Errors
    ///
    /// A picture that is damaged, or larger than what may be decoded.
    pub fn load(path: &Path) -> Result<Option<Self>, SceneError> {
        let bytes =
            std::fs::read(path).map_err(|e| SceneError::Texture { path: path.to_owned(), why: e.to_string() })?;
        Self::decode(path, bytes.into())
    }

    /// The same from the bytes of a file; `path` is for messages.
    ///
    /// # Errors
    ///
    /// As [`Texture::load`].
    pub(super) fn decode(path: &Path, bytes: Arc<[u8]>) -> Result<Option<Self>, SceneError> {
        let fault = |why: String| SceneError::Texture { path: path.to_owned(), why };
        // decoders may panic on damaged bytes
        let decoded = catch_unwind(|| picture(path, &bytes))
            .map_err(|_| fault("it is damaged: its decoder broke off".to_owned()))?;
        let picture = match decoded {
            Ok(picture) => picture?.into_rgba8(),
            Err(ImageError::Unsupported(_)) => return Ok(None),
            Err(e) => return Err(fault(e.to_string())),
        };
        let (width, height) = picture.dimensions();
        if width == 0 || height == 0 {
            return Err(fault("it has no pixels".to_owned()));
        }
        let texels = picture.as_raw().as_chunks().0.to_vec();
        let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let texture = Self::new(name, width as usize, height as usize, texels);
        Ok(Some(Self { file: kind_of(&bytes).map(|_| bytes), ..texture }))
    }

    /// The picture as a PNG or JPEG file, and its media type: the very file it was read from where that is one.
    ///
    /// # Errors
    ///
    /// What the encoder says.
    pub(crate) fn encoded(&self) -> Result<(Arc<[u8]>, &'static str), String> {
        if let Some((file, kind)) = self.file.as_ref().and_then(|f| Some((f, kind_of(f)?))) {
            return Ok((file.clone(), kind));
        }
        let level = &self.levels[0];
        let rgb = level.texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect();
        let picture = image::RgbImage::from_raw(level.width as u32, level.height as u32, rgb).unwrap_or_default();
        let mut bytes = Vec::new();
        picture.write_with_encoder(PngEncoder::new(&mut bytes)).map_err(|e| e.to_string())?;
        Ok((bytes.into(), ImageFormat::Png.to_mime_type()))
    }

    /// A texture from `width × height` sRGB texels, rows from the top. Neither side may be zero.
    pub fn new(name: String, width: usize, height: usize, texels: Vec<[u8; 4]>) -> Self {
        assert!(width > 0 && height > 0 && texels.len() == width * height);
        let wrap = [Wrap::Repeat; 2];
        let mut levels = vec![Level { width, height, texels, wrap, linear: LINEAR.clone() }];
        while let Some(last) = levels.last()
            && (last.width > 1 || last.height > 1)
        {
            let next = last.halved();
            levels.push(next);
        }
        Self { name, levels, file: None }
    }

    /// The same that goes on in another way, across and down.
    pub fn wrapped(mut self, wrap: [Wrap; 2]) -> Self {
        self.levels.iter_mut().for_each(|level| level.wrap = wrap);
        self
    }

    /// How it goes on beyond its edges, across and down.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.levels[0].wrap
    }

    /// Alpha of a texel, 0..=1, from the top left.
    pub(super) fn alpha(&self, x: usize, y: usize) -> f32 {
        let level = &self.levels[0];
        f32::from(level.texels[y * level.width + x][3]) / 255.0
    }

    /// Mean of a texel's three codes as they are, 0..=1, from the top left.
    pub(super) fn brightness(&self, x: usize, y: usize) -> f32 {
        let level = &self.levels[0];
        let [r, g, b, _] = level.texels[y * level.width + x].map(f32::from);
        (r + g + b) / 765.0
    }

    /// Width and height in texels.
    pub fn size(&self) -> (usize, usize) {
        (self.levels[0].width, self.levels[0].height)
    }

    /// A level of the pyramid: its size, and its sRGB texels by rows from the top. 0 is the picture itself, which alone has
    /// alpha.
    #[cfg(feature = "gpu")]
    pub(crate) fn level(&self, level: usize) -> Option<([usize; 2], &[[u8; 4]])> {
        self.levels.get(level).map(|l| ([l.width, l.height], l.texels.as_slice()))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| l.texels.len() * 4).sum()
    }

    /// The pyramid level whose texels are so many of the picture's own wide; 0 is the picture itself.
    #[inline]
    pub fn level_of(texels: f32) -> f32 {
        if texels > 1.0 { texels.log2() } else { 0.0 }
    }

    /// The pyramid level whose texels are nearest to so many of the picture's own wide.
    #[inline]
    pub fn whole_level(texels: f32) -> usize {
        // the exponent of a float, rounded at √2: no call into the C library
        let rounded = (texels * std::f32::consts::SQRT_2).max(1.0);
        ((rounded.to_bits() >> 23) & 0xff) as usize - 127
    }

    /// How many texels long a way in texture coordinates is.
    #[inline]
    pub fn texels(&self, way: Vec2) -> f32 {
        let (w, h) = self.size();
        (way * Vec2::new(w as f32, h as f32)).length()
    }

    /// How many texels apart the places of a [patch](Self::patch) may be: more than one, since each is the mean of two by two.
    pub const APART: f32 = 1.5;

    /// Linear RGB averaged over a parallelogram about texture coordinates `uv`: bilinear in the level whose texels are about
    /// half its shorter side wide, over places `apart` texels apart.
    #[inline]
    pub fn patch(&self, uv: Vec2, right: Vec2, down: Vec2, apart: f32) -> Vec3 {
        /// Texels' width, as a share of the shorter side.
        const WIDE: f32 = 0.6;
        /// Most places along a side.
        const MOST: f32 = 16.0;
        let (across, along) = (self.texels(right), self.texels(down));
        let (short, long) = (across.min(along), across.max(along));
        let level = Self::whole_level((WIDE * short).max(long / MOST));
        let texel = (1u32 << level.min(31)) as f32;
        let count = |length: f32| (length / (apart * texel) + 0.5).clamp(1.0, MOST) as u32;
        self.sample_patch(uv, (right, count(across)), (down, count(along)), level)
    }

    /// Linear RGB averaged over a parallelogram about texture coordinates `uv`: bilinear in one level at so many places
    /// along each of its sides.
    fn sample_patch(&self, uv: Vec2, right: (Vec2, u32), down: (Vec2, u32), level: usize) -> Vec3 {
        let level = &self.levels[level.min(self.levels.len() - 1)];
        let (columns, rows) = (right.1.max(1), down.1.max(1));
        let (across, along) = (level.texels(right.0) / columns as f32, level.texels(down.0) / rows as f32);
        let middle = level.place(uv);
        let first = middle - across * (0.5 * (columns - 1) as f32) - along * (0.5 * (rows - 1) as f32);
        let mut sum = Vec4::ZERO;
        for j in 0..rows {
            let row = first + along * j as f32;
            for i in 0..columns {
                sum += level.between(row + across * i as f32);
            }
        }
        sum.truncate() * (1.0 / (columns * rows) as f32)
    }

    /// Linear RGB at texture coordinates `uv`, bilinear in the level whose texels are nearest to so many of the picture's own
    /// wide.
    #[inline]
    pub fn near(&self, uv: Vec2, texels: f32) -> Vec3 {
        self.levels[Self::whole_level(texels).min(self.levels.len() - 1)].bilinear(uv)
    }

    /// Linear RGB at texture coordinates `uv`, bilinear, between pyramid levels linear.
    pub fn sample(&self, uv: Vec2, level: f32) -> Vec3 {
        let top = self.levels.len() - 1;
        let lower = (level as usize).min(top);
        let f = (level - lower as f32).clamp(0.0, 1.0);
        let a = self.levels[lower].bilinear(uv);
        if f < 1e-3 || lower == top { a } else { a.lerp(self.levels[lower + 1].bilinear(uv), f) }
    }
}

/// Decodes a file's bytes, if its size and what that takes are within the limits.
fn picture(path: &Path, bytes: &[u8]) -> ImageResult<Result<DynamicImage, SceneError>> {
    /// Texels and their levels, beside what was decoded.
    const BYTES_PER_TEXEL: u64 = 10;
    let (decoder, decoding) = opened(Cursor::new(bytes), image::guess_format(bytes)?)?;
    let (width, height) = decoder.dimensions();
    if width.max(height) > MAX_SIDE {
        let why = format!("it has {width} × {height} pixels");
        return Ok(Err(SceneError::Texture { path: path.to_owned(), why }));
    }
    let texels = u64::from(width) * u64::from(height) * BYTES_PER_TEXEL;
    if let Err(over) = memory::check(decoding.saturating_add(texels)) {
        return Ok(Err(SceneError::Memory { path: path.to_owned(), over }));
    }
    DynamicImage::from_decoder(decoder).map(Ok)
}

/// The media type of a PNG or JPEG file, by its first bytes.
fn kind_of(file: &[u8]) -> Option<&'static str> {
    let format = image::guess_format(file).ok()?;
    matches!(format, ImageFormat::Png | ImageFormat::Jpeg).then(|| format.to_mime_type())
}

/// The next whole number below; without a call into the C library.
#[inline]
fn floor(x: f32) -> f32 {
    let i = x as i32 as f32;
    if i > x { i - 1.0 } else { i }
}

impl Level {
    fn texel(&self, x: usize, y: usize) -> Vec3 {
        self.at(y * self.width + x).truncate()
    }

    #[inline]
    fn bilinear(&self, uv: Vec2) -> Vec3 {
        self.between(self.place(uv)).truncate()
    }

    /// A way in texture coordinates, in texels to the right and down.
    #[inline]
    fn texels(&self, way: Vec2) -> Vec2 {
        way * Vec2::new(self.width as f32, -(self.height as f32))
    }

    /// Texture coordinates in texels from the middle of the top left texel; of a picture that repeats, those of the one
    /// that they fall into.
    #[inline]
    fn place(&self, uv: Vec2) -> Vec2 {
        let within = |x: f32, wrap: Wrap| if wrap == Wrap::Repeat { x - floor(x) } else { x };
        let (u, v) = (within(uv.x, self.wrap[0]), within(uv.y, self.wrap[1]));
        Vec2::new(u * self.width as f32, (1.0 - v) * self.height as f32) - 0.5
    }

    /// Linear RGB at a [place](Self::place), bilinear.
    #[inline]
    fn between(&self, place: Vec2) -> Vec4 {
        let (x0, y0) = (floor(place.x), floor(place.y));
        let (fx, fy) = (place.x - x0, place.y - y0);
        let (x, y) = (x0 as i32, y0 as i32);
        let (xa, ya) = (self.wrap[0].texel(x, self.width), self.wrap[1].texel(y, self.height));
        let (xb, yb) =
            (self.wrap[0].texel(x.saturating_add(1), self.width), self.wrap[1].texel(y.saturating_add(1), self.height));
        let (above, below) = (ya * self.width, yb * self.width);
        let upper = self.at(above + xa).lerp(self.at(above + xb), fx);
        upper.lerp(self.at(below + xa).lerp(self.at(below + xb), fx), fy)
    }

    #[inline]
    fn at(&self, i: usize) -> Vec4 {
        let [r, g, b, _] = self.texels[i];
        let table = &self.linear;
        Vec4::new(table[usize::from(r)], table[usize::from(g)], table[usize::from(b)], 0.0)
    }

    /// Half the size in each direction, averaged in linear light. An odd size drops no texel: the last is repeated.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let (xa, ya) = (2 * x, 2 * y);
                let (xb, yb) = ((xa + 1).min(self.width - 1), (ya + 1).min(self.height - 1));
                let mean = (self.texel(xa, ya) + self.texel(xb, ya) + self.texel(xa, yb) + self.texel(xb, yb)) * 0.25;
                let [r, g, b] = mean.to_array().map(linear_to_code);
                texels.push([r, g, b, 255]);
            }
        }
        Self { width, height, texels, wrap: self.wrap, linear: self.linear.clone() }
    }
}
