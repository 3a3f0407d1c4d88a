//! Materials of glTF: base colour, its picture, its mask, and light sent out.

use glam::{Vec2, Vec3, Vec4};
use gltf::material::AlphaMode;
use gltf::texture::{TextureTransform, WrappingMode};
use std::sync::Arc;

use super::document::{File, embedded, unescaped};
use crate::scene::Wrap;
use crate::scene::model::{Channel, Cutout, Map, ModelMaterial, UNKNOWN_ALBEDO};

impl File<'_> {
    pub(super) fn material(&self, material: &gltf::Material, warnings: &mut Vec<String>) -> ModelMaterial {
        let index = material.index().unwrap_or(0);
        let name = material.name().filter(|n| !n.is_empty()).map_or_else(|| format!("material {index}"), str::to_owned);
        // names need not differ
        let taken = self.document.materials().take(index).any(|m| m.name() == Some(&name));
        let name = if taken { format!("{name} ({index})") } else { name };
        let pbr = material.pbr_metallic_roughness();
        let factor = Vec4::from(pbr.base_color_factor()).truncate();
        let albedo = if factor.is_finite() { factor.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::splat(UNKNOWN_ALBEDO) };
        let texture = pbr.base_color_texture().map(|info| info.texture());
        let wrap = texture.as_ref().map_or([Wrap::Repeat; 2], |t| {
            [t.sampler().wrap_s(), t.sampler().wrap_t()].map(|mode| match mode {
                WrappingMode::ClampToEdge => Wrap::Clamp,
                WrappingMode::MirroredRepeat => Wrap::Mirror,
                WrappingMode::Repeat => Wrap::Repeat,
            })
        });
        // a texture may be without a picture that is known here
        let (textures, images) = (&self.document.as_json().textures, self.document.images().len());
        let texture = texture.filter(|t| textures[t.index()].source.value() < images);
        let map = texture.and_then(|t| self.picture(&t.source(), &name, warnings));
        let map = map.map(|(name, embedded)| Map {
            name,
            file: self.path.to_owned(),
            line: 0,
            plain_albedo: albedo,
            embedded,
            wrap,
        });
        let cutoff = material.alpha_cutoff().unwrap_or(0.5);
        let cutout = (material.alpha_mode() == AlphaMode::Mask).then(|| Cutout {
            map: None,
            channel: Channel::Alpha,
            factor: pbr.base_color_factor()[3],
            cutoff,
        });
        let glow = Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        if material.emissive_texture().is_some() && glow != Vec3::ZERO {
            warnings
                .push(format!("Material “{name}” glows by a picture, which is passed over: it sends out no light."));
        }
        let lamp = material.emissive_texture().is_none() && glow.is_finite();
        let emission = if lamp { glow.max(Vec3::ZERO) } else { Vec3::ZERO };
        ModelMaterial { name, albedo, emission, map, cutout }
    }

    /// A picture's name and, where it stands in the file, its bytes.
    fn picture(
        &self,
        image: &gltf::Image,
        material: &str,
        warnings: &mut Vec<String>,
    ) -> Option<(String, Option<Arc<[u8]>>)> {
        let name = || {
            let images = &self.document.as_json().images;
            let own = |index: usize| match images.get(index).and_then(|i| i.name.as_deref()) {
                Some(name) if !name.is_empty() => name.to_owned(),
                _ => format!("image {index}"),
            };
            let (index, name) = (image.index(), own(image.index()));
            // names need not differ, neither from each other nor from those of files
            let is_file = || {
                images
                    .iter()
                    .filter_map(|i| i.uri.as_deref())
                    .any(|uri| !uri.starts_with("data:") && unescaped(uri) == name)
            };
            let taken = (0..index).any(|other| own(other) == name) || is_file();
            if taken { format!("{name} ({index})") } else { name }
        };
        match image.source() {
            gltf::image::Source::View { view, .. } => {
                let bytes = self.buffers.get(view.buffer().index());
                let bytes = bytes.and_then(|b| b.get(view.offset()..view.offset().checked_add(view.length())?));
                bytes.map(|bytes| (name(), Some(bytes.into())))
            }
            gltf::image::Source::Uri { uri, .. } if uri.starts_with("data:") => match embedded(uri) {
                Ok(bytes) => Some((name(), Some(bytes.into()))),
                Err(why) => {
                    warnings.push(format!("Material “{material}”: its picture cannot be used: {why}."));
                    None
                }
            },
            gltf::image::Source::Uri { uri, .. } => Some((unescaped(uri), None)),
        }
    }
}

/// The set of texture coordinates that the base colour's picture takes, and how they are moved; `None` without a picture.
pub(super) fn uv_set<'a>(primitive: &gltf::Primitive<'a>) -> Option<(u32, Option<TextureTransform<'a>>)> {
    let info = primitive.material().pbr_metallic_roughness().base_color_texture()?;
    let transform = info.texture_transform();
    let own = transform.as_ref().and_then(TextureTransform::tex_coord);
    Some((own.unwrap_or_else(|| info.tex_coord()), transform))
}

/// `KHR_texture_transform`: offset + rotation · scale · uv.
pub(super) fn moved(uv: Vec2, transform: Option<&TextureTransform>) -> Vec2 {
    let Some(transform) = transform else { return uv };
    let (sin, cos) = transform.rotation().sin_cos();
    let uv = uv * Vec2::from(transform.scale());
    Vec2::from(transform.offset()) + Vec2::new(cos * uv.x + sin * uv.y, cos * uv.y - sin * uv.x)
}
