//! What a card holds of a baked model: vertices, light, runs of triangles, pictures, the sky.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;
use wgpu::BufferUsages;

use super::GpuError;
use super::device::Card;
use super::mips;
use crate::bake::{self, Baked};
use crate::panorama::LINEAR;
use crate::scene::{Scene, Texture, Wrap};

/// A vertex but for its light.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Corner {
    pub(super) at: [f32; 3],
    /// v = 0 at the picture's top row.
    pub(super) uv: [f32; 2],
    /// Albedo but for the picture, ÷ π.
    pub(super) reflectance: [f32; 3],
}

/// A baked model on a card.
pub(super) struct Model {
    pub(super) corners: wgpu::Buffer,
    pub(super) irradiance: wgpu::Buffer,
    pub(super) vertices: usize,
    /// What the sun adds, where it is kept apart.
    pub(super) sunlight: Option<wgpu::Buffer>,
    pub(super) indices: wgpu::Buffer,
    /// Triangles in [`Self::indices`]; those after the last run are not drawn but cast shadows.
    pub(super) triangles: u32,
    pub(super) runs: Vec<bake::Run>,
    /// The first is white.
    pub(super) pictures: Vec<wgpu::BindGroup>,
    /// Which of them each material has.
    pub(super) picture_of: Vec<usize>,
    pub(super) sky: wgpu::TextureView,
}

impl Model {
    /// Hands a baked model under a lighting to the card; `layout` is that of a picture and its sampler.
    pub(super) fn new(
        card: &Card,
        layout: &wgpu::BindGroupLayout,
        scene: &Scene,
        baked: &Baked,
        lighting: usize,
    ) -> Result<Self, GpuError> {
        let known = (baked.irradiance.get(lighting), baked.skies.get(lighting));
        let (Some(irradiance), Some(sky)) = known else {
            return Err(GpuError::Lighting { asked: lighting, baked: baked.irradiance.len() });
        };
        let sunlight = baked.sunlight.get(lighting).filter(|s| !s.is_empty());
        let light = |light: &[Vec3]| {
            card.buffer("the vertices' light", &floats(light), BufferUsages::VERTEX | BufferUsages::COPY_DST)
        };
        let (pictures, picture_of) = pictures(card, layout, scene, baked);
        let (mut corners, mut triangles) = (corners(scene, baked), baked.triangles.clone());
        for hidden in &baked.hidden {
            triangles.push([0, 1, 2].map(|k| (corners.len() + k) as u32));
            let at = scene.mesh.corners(*hidden);
            corners.extend(at.map(|p| Corner { at: p.to_array(), uv: [0.0; 2], reflectance: [0.0; 3] }));
        }
        let cells: Vec<[f32; 4]> = sky.pixels.iter().map(|p| p.extend(1.0).to_array()).collect();
        Ok(Self {
            corners: card.buffer("the vertices", &corners, BufferUsages::VERTEX)?,
            irradiance: light(irradiance)?,
            vertices: irradiance.len(),
            sunlight: sunlight.map(|s| light(s)).transpose()?,
            indices: card.buffer("the triangles", triangles.as_flattened(), BufferUsages::INDEX)?,
            triangles: triangles.len() as u32,
            runs: baked.runs(&baked.triangles, &baked.materials),
            pictures,
            picture_of,
            sky: filled(card, "the sky", wgpu::TextureFormat::Rgba32Float, &[([sky.width, sky.height], cells)]),
        })
    }
}

/// Colours as a card reads them.
pub(super) fn floats(colours: &[Vec3]) -> Vec<[f32; 3]> {
    colours.iter().map(Vec3::to_array).collect()
}

/// Triangles of each material that is in use.
fn in_use(baked: &Baked) -> impl Iterator<Item = (usize, std::ops::Range<u32>)> + '_ {
    baked.materials.windows(2).enumerate().map(|(m, ends)| (m, ends[0]..ends[1])).filter(|(_, t)| !t.is_empty())
}

fn corners(scene: &Scene, baked: &Baked) -> Vec<Corner> {
    // no vertex is part of two materials
    let mut albedo = vec![Vec3::ZERO; baked.vertices.len()];
    for (m, triangles) in in_use(baked) {
        let (plain, _) = scene.materials[m].with_white_lamps();
        for &v in baked.triangles[triangles.start as usize..triangles.end as usize].as_flattened() {
            let v = v as usize;
            albedo[v] = plain * baked.vertices[v].colour;
        }
    }
    (baked.vertices.par_iter().zip(&albedo))
        .map(|(v, albedo)| {
            let uv = if v.uv.is_finite() { Vec2::new(v.uv.x, 1.0 - v.uv.y) } else { Vec2::ZERO };
            Corner { at: v.position.to_array(), uv: uv.to_array(), reflectance: (albedo / PI).to_array() }
        })
        .collect()
}

/// The pictures in use with their samplers, a white one first, and which of them each material has.
fn pictures(
    card: &Card,
    layout: &wgpu::BindGroupLayout,
    scene: &Scene,
    baked: &Baked,
) -> (Vec<wgpu::BindGroup>, Vec<usize>) {
    let mut number = vec![0; scene.textures.len()];
    let mut all = vec![picture(card, layout, &Texture::blank())];
    let mut picture_of = vec![0; scene.materials.len()];
    for (m, _) in in_use(baked) {
        let Some(t) = scene.materials[m].with_white_lamps().1 else { continue };
        let number = &mut number[t as usize];
        if *number == 0 {
            *number = all.len();
            all.push(picture(card, layout, &scene.textures[t as usize]));
        }
        picture_of[m] = *number;
    }
    (all, picture_of)
}

fn picture(card: &Card, layout: &wgpu::BindGroupLayout, texture: &Texture) -> wgpu::BindGroup {
    let levels = mips::levels(texture, card.device.limits().max_texture_dimension_2d as usize);
    // cards decode sRGB in their own ways, some half a percent off
    let linear = LINEAR.map(half);
    let decoded = |texels: &[[u8; 4]]| texels.par_iter().map(|t| t.map(|code| linear[usize::from(code)])).collect();
    let levels: Vec<([usize; 2], Vec<[u16; 4]>)> =
        levels.iter().map(|(size, texels)| (*size, decoded(texels))).collect();
    let view = filled(card, "a picture", wgpu::TextureFormat::Rgba16Float, &levels);
    let [u, v] = texture.wrap().map(|wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
    });
    let sampler = card.device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: u,
        address_mode_v: v,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    let resources = [wgpu::BindingResource::TextureView(&view), wgpu::BindingResource::Sampler(&sampler)];
    bind_group(card, layout, &resources)
}

/// The nearest half-precision float (IEEE 754 binary16) of a number from 2⁻¹⁴ to 1, or of 0.
fn half(v: f32) -> u16 {
    let bits = v.to_bits();
    if bits == 0 { 0 } else { (((bits + 0xfff + (bits >> 13 & 1)) >> 13) - (112 << 10)) as u16 }
}

/// A texture with these levels in it, each with its size, to be read from.
fn filled<T: bytemuck::NoUninit>(
    card: &Card,
    label: &'static str,
    format: wgpu::TextureFormat,
    levels: &[([usize; 2], Vec<T>)],
) -> wgpu::TextureView {
    let [width, height] = levels[0].0.map(|n| n as u32);
    let mut asked = described(label, width, height, format);
    asked.mip_level_count = levels.len() as u32;
    asked.usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let image = card.device.create_texture(&asked);
    for (mip_level, ([width, height], texels)) in (0..).zip(levels) {
        let place = wgpu::TexelCopyTextureInfo { mip_level, ..image.as_image_copy() };
        let bytes_per_row = Some((width * size_of::<T>()) as u32);
        let rows = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        let size = wgpu::Extent3d { width: *width as u32, height: *height as u32, depth_or_array_layers: 1 };
        card.queue.write_texture(place, bytemuck::cast_slice(texels), rows, size);
    }
    image.create_view(&wgpu::TextureViewDescriptor::default())
}

/// A plain texture, to be drawn into or read from.
pub(super) fn described(
    label: &'static str,
    width: u32,
    height: u32,
    format: wgpu::TextureFormat,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    }
}

/// Resources as they stand in a layout: 0, 1, 2, …
pub(super) fn bind_group(
    card: &Card,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource],
) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    card.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_keep_eleven_bits_of_their_light() {
        assert_eq!([0.0, 0.5, 0.75, 1.0].map(half), [0, 0x3800, 0x3a00, 0x3c00]);
        for (code, v) in LINEAR.iter().enumerate().skip(1) {
            let h = half(*v);
            let back = (1.0 + f32::from(h & 0x3ff) / 1024.0) * (f32::from(h >> 10) - 15.0).exp2();
            assert!((back / v - 1.0).abs() <= 1.0 / 2048.0, "{code}: {v} became {back}");
        }
    }
}
