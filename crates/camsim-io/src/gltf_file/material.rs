//! Materials: base colour, emissive light, alpha, sides, and texture coordinates.

use std::{collections::HashMap, sync::Arc};

use camsim_core::scene::{Encoding, Material, Shape, Texture, Wrap};
use gltf::{
    material::AlphaMode,
    texture::{Info, MagFilter, WrappingMode},
};

use super::{
    GltfError,
    asset::Asset,
    bake::BakeInput,
    emissive::{self, Layer},
};

/// Alpha from which on a blended surface writes depth: a pixel has one depth, that of the surface which
/// contributes most of its light.
const BLEND_CUTOFF: f32 = 0.5;
/// Factor on the cut-off, so that texels with exactly its alpha pass despite the rounding of vertex alphas
/// and of half floats.
const CUTOFF_FACTOR: f32 = 1.0 - 5e-4;

/// How a material turns a primitive's attributes into texture coordinates and tints.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexRule {
    /// Set of texture coordinates: n of TEXCOORD_n.
    pub set: u32,
    /// Offset of `KHR_texture_transform`.
    pub offset: [f64; 2],
    /// Rotation of `KHR_texture_transform`, radians.
    pub rotation_rad: f64,
    /// Scale of `KHR_texture_transform`; 0 without a texture.
    pub scale: [f64; 2],
    /// Factor of every vertex colour, linear red, green, blue, alpha.
    pub factor: [f32; 4],
    /// Whether COLOR_0 applies: it does not apply to emissive light.
    pub uses_vertex_colors: bool,
    /// Whether COLOR_0 is ignored because base colour and emissive light share one texture.
    pub ignores_vertex_colors: bool,
    /// Whether the scene's light falls on the surface: not on unlit or emissive ones.
    pub is_lit: bool,
}

/// A texture, its wrap modes and whether it is sampled by the nearest texel.
type SampledTexture = (Arc<Texture>, [Wrap; 2], bool);

/// Cache of a file's materials and textures.
#[derive(Debug)]
pub(super) struct Materials<'a> {
    asset: &'a Asset,
    white: Arc<Texture>,
    /// Texture by image index and whether its alpha is used.
    textures: HashMap<(usize, bool), Arc<Texture>>,
    /// Whether a texture has an alpha below 1, by address.
    has_transparency: HashMap<*const Texture, bool>,
    /// Material by index; `None` is the default material.
    known: HashMap<Option<usize>, (Material, VertexRule)>,
    /// Materials whose emissive texture has other texture coordinates than the base colour.
    bakes: HashMap<Option<usize>, BakeInput>,
    pub notes: Vec<String>,
}

/// Longest texture side that any GPU supports, pixels.
const MAX_SIDE_PX: u32 = 32_768;
/// Longest texture side that common GPUs support, pixels.
const COMMON_MAX_SIDE_PX: u32 = 16_384;
/// Brightest emitted light, whites: the largest half float, as ideal frames have.
const MOST_EMISSIVE: f32 = 65_504.0;
/// Pixels above which a note states the GPU memory: a third of a gigabyte with mip levels.
const LARGE_TEXTURE_PX: u64 = 1 << 26;

impl<'a> Materials<'a> {
    pub fn new(asset: &'a Asset) -> Self {
        let white = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        Self {
            asset,
            white,
            textures: HashMap::new(),
            has_transparency: HashMap::new(),
            known: HashMap::new(),
            bakes: HashMap::new(),
            notes: Vec::new(),
        }
    }

    /// The material and its rule for vertices, from the cache if it has been read before.
    pub fn get(&mut self, material: &gltf::Material<'_>) -> Result<(Material, VertexRule), GltfError> {
        if let Some(known) = self.known.get(&material.index()) {
            return Ok(known.clone());
        }
        // The diffuse colour of the older specular-glossiness workflow is taken as the base colour.
        let (specular_glossiness, metallic_roughness) =
            (material.pbr_specular_glossiness(), material.pbr_metallic_roughness());
        let (key, factor, base_texture) = match &specular_glossiness {
            Some(pbr) => (
                "extensions.KHR_materials_pbrSpecularGlossiness.diffuseFactor",
                pbr.diffuse_factor(),
                pbr.diffuse_texture(),
            ),
            None => (
                "pbrMetallicRoughness.baseColorFactor",
                metallic_roughness.base_color_factor(),
                metallic_roughness.base_color_texture(),
            ),
        };
        let strength = self.asset.emissive_strength(material.index());
        let emissive_factor = material.emissive_factor().map(|part| part * strength);
        let emissive_key =
            if strength == 1.0 { "emissiveFactor" } else { "emissiveFactor times emissiveStrength" };
        // A factor alone ends at white, and so does the texture of 8 bits that is made of a picture and a factor.
        let is_strong = strength != 1.0 && material.emissive_texture().is_none();
        let most_emissive = if is_strong { MOST_EMISSIVE } else { 1.0 };
        self.check_factors(material, [(key, &factor, 1.0), (emissive_key, &emissive_factor, most_emissive)])?;
        let emissive_factor = emissive_factor.map(|part| part.clamp(0.0, most_emissive));
        // KHR_materials_unlit shows the base colour alone.
        let is_emissive = !material.unlit() && emissive_factor.iter().any(|&part| part > 0.0);
        // A black base colour still gives the alpha.
        let has_alpha = material.alpha_mode() != AlphaMode::Opaque;
        let is_black = factor[..3].iter().all(|&part| part == 0.0) && !(has_alpha && base_texture.is_some());
        let mut rule = VertexRule {
            set: 0,
            offset: [0.0; 2],
            rotation_rad: 0.0,
            scale: [1.0; 2],
            factor,
            uses_vertex_colors: true,
            ignores_vertex_colors: false,
            is_lit: !material.unlit(),
        };
        let mut emissive = [0.0; 3];
        let mut added_texture = None;
        let info = match (base_texture, material.emissive_texture()) {
            // The emissive texture alone.
            (_, Some(info)) if is_emissive && is_black => {
                rule.factor = [emissive_factor[0], emissive_factor[1], emissive_factor[2], factor[3]];
                rule.uses_vertex_colors = false;
                rule.is_lit = false;
                Some(info)
            }
            (info, emissive_texture) => {
                if is_emissive {
                    emissive = if emissive_texture.is_some() { [0.0; 3] } else { emissive_factor };
                    added_texture = emissive_texture;
                }
                info
            }
        };
        let combined = match &added_texture {
            Some(emissive_info) => {
                let textures = (info.as_ref(), emissive_info);
                self.with_emissive(material.index(), textures, has_alpha, emissive_factor, &mut rule)?
            }
            None => None,
        };
        let (texture, wrap, nearest) = match (combined, &info) {
            (Some(combined), _) => combined,
            (None, None) => {
                // `has_texture` reads this.
                rule.scale = [0.0; 2];
                (self.white.clone(), [Wrap::Repeat; 2], false)
            }
            // The alpha of an emissive texture is not used.
            (None, Some(info)) => {
                self.sampled_texture(info, has_alpha && !(is_emissive && is_black), &mut rule)?
            }
        };
        let cutoff = match material.alpha_mode() {
            AlphaMode::Opaque => None,
            AlphaMode::Mask => Some(material.alpha_cutoff().unwrap_or(0.5)),
            AlphaMode::Blend => Some(BLEND_CUTOFF),
        };
        let cutoff = cutoff.map(|alpha: f32| CUTOFF_FACTOR * alpha);
        let blends = material.alpha_mode() == AlphaMode::Blend;
        let result = Material {
            texture,
            wrap,
            nearest,
            emissive,
            cutoff,
            blends,
            one_sided: !material.double_sided(),
        };
        self.known.insert(material.index(), (result.clone(), rule));
        Ok((result, rule))
    }

    /// Refuses factors that are not finite and notes those outside of 0 to their limit.
    fn check_factors(
        &mut self,
        material: &gltf::Material<'_>,
        factors: [(&str, &[f32], f32); 2],
    ) -> Result<(), GltfError> {
        let name = self.asset.material_name(material.index());
        for (key, parts, most) in factors {
            if parts.iter().any(|part| !part.is_finite()) {
                return Err(self.asset.error(format!(
                    "{name}: {key} is {parts:?}, which is not finite: give numbers from 0 to {most}"
                )));
            }
            if parts.iter().any(|part| !(0.0..=most).contains(part)) {
                let of_picture = if key.ends_with("emissiveStrength") && most == 1.0 {
                    "; above white it needs a material without emissiveTexture"
                } else {
                    ""
                };
                self.notes
                    .push(format!("{name}: {key} is {parts:?} and is clamped to 0 to {most}{of_picture}"));
            }
        }
        let cutoff = material.alpha_cutoff().unwrap_or(0.5);
        if cutoff.is_finite() {
            Ok(())
        } else {
            Err(self.asset.error(format!("{name}: alphaCutoff is {cutoff}, which is not finite")))
        }
    }

    /// The material for a shape: a blended one is opaque where neither its texture nor its vertices have an
    /// alpha below 1.
    pub fn for_shape(&mut self, shape: &Shape, material: Material) -> Material {
        let texture = &material.texture;
        let has_transparency = || texture.rgba8.chunks_exact(4).any(|pixel| pixel[3] < 255);
        let is_blended = material.blends
            && (shape.vertices.iter().any(|vertex| vertex.tint[3] < 1.0)
                || *self.has_transparency.entry(Arc::as_ptr(texture)).or_insert_with(has_transparency));
        if material.blends && !is_blended {
            Material { blends: false, cutoff: None, ..material }
        } else {
            material
        }
    }

    /// The textures to bake for each shape of this material, if its emissive texture has other coordinates.
    pub fn bake_input(&self, material: &gltf::Material<'_>) -> Option<BakeInput> {
        self.bakes.get(&material.index()).cloned()
    }

    /// Base colour and emissive light as one texture. `None` if their texture coordinates differ: then they
    /// are stored to be baked for each shape.
    fn with_emissive(
        &mut self,
        material: Option<usize>,
        (base_info, emissive_info): (Option<&Info<'_>>, &Info<'_>),
        has_alpha: bool,
        emissive_factor: [f32; 3],
        rule: &mut VertexRule,
    ) -> Result<Option<SampledTexture>, GltfError> {
        let layer = |(texture, wrap, nearest): SampledTexture, rule: VertexRule| {
            Layer::new(texture, wrap, nearest, rule)
        };
        let mut emissive_rule = *rule;
        let emissive_layer =
            layer(self.sampled_texture(emissive_info, false, &mut emissive_rule)?, emissive_rule);
        let base = match base_info {
            Some(info) => layer(self.sampled_texture(info, has_alpha, rule)?, *rule),
            None => {
                *rule = emissive_rule;
                Layer::new(self.white.clone(), emissive_layer.wrap, emissive_layer.nearest, emissive_rule)
            }
        };
        let coordinates = |layer: &Layer| {
            let rule = &layer.rule;
            (rule.set, rule.offset, rule.rotation_rad, rule.scale, layer.wrap, layer.nearest)
        };
        let [r, g, b, alpha] = rule.factor;
        if coordinates(&base) != coordinates(&emissive_layer) {
            self.bakes.insert(material, BakeInput { base, emissive: emissive_layer, emissive_factor });
            return Ok(None);
        }
        let texture = emissive::add_emissive(&base, [r, g, b], &emissive_layer, emissive_factor);
        *rule = VertexRule {
            factor: [1.0, 1.0, 1.0, alpha],
            uses_vertex_colors: false,
            ignores_vertex_colors: true,
            is_lit: false,
            ..*rule
        };
        Ok(Some((Arc::new(texture), base.wrap, base.nearest)))
    }

    /// The texture with its sampler; sets the texture coordinates in `rule`.
    fn sampled_texture(
        &mut self,
        info: &Info<'_>,
        has_alpha: bool,
        rule: &mut VertexRule,
    ) -> Result<SampledTexture, GltfError> {
        rule.set = info.tex_coord();
        if let Some(transform) = info.texture_transform() {
            rule.set = transform.tex_coord().unwrap_or(rule.set);
            rule.offset = transform.offset().map(f64::from);
            rule.rotation_rad = f64::from(transform.rotation());
            rule.scale = transform.scale().map(f64::from);
        }
        let sampler = info.texture().sampler();
        let wrap = |mode| match mode {
            WrappingMode::ClampToEdge => Wrap::Clamp,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::Repeat => Wrap::Repeat,
        };
        let texture = self.texture(&info.texture().source(), has_alpha)?;
        Ok((
            texture,
            [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
            sampler.mag_filter() == Some(MagFilter::Nearest),
        ))
    }

    /// The decoded image as a texture, from the cache if it has been read before.
    fn texture(&mut self, image: &gltf::Image<'_>, has_alpha: bool) -> Result<Arc<Texture>, GltfError> {
        let key = (image.index(), has_alpha);
        if let Some(texture) = self.textures.get(&key) {
            return Ok(texture.clone());
        }
        let bytes = self.asset.image(image)?;
        let number = image.index();
        let error = |reason: String| self.asset.error(format!("images.{number}: {reason}"));
        let decode_error = |reason: String| {
            error(format!("cannot be decoded as PNG, JPEG or WebP: {reason}; convert it to one of them"))
        };
        let [width, height] = crate::raster::pictures::size_of_bytes(&bytes).map_err(decode_error)?;
        if width.max(height) > MAX_SIDE_PX {
            return Err(error(format!(
                "has {width}x{height} px, but a side can have at most {MAX_SIDE_PX}: make it smaller"
            )));
        }
        if width.max(height) > COMMON_MAX_SIDE_PX || u64::from(width) * u64::from(height) > LARGE_TEXTURE_PX {
            let mib = (u64::from(width) * u64::from(height) * 16 / 3).div_ceil(1 << 20);
            self.notes.push(format!(
                "images.{number}: has {width}x{height} px and takes {mib} MiB of GPU memory; many GPUs \
                 support at most {COMMON_MAX_SIDE_PX} px on a side: consider a smaller image"
            ));
        }
        let decoded = crate::raster::pictures::decode_bytes(&bytes).map_err(decode_error)?;
        let size_px = [decoded.width(), decoded.height()];
        let mut texture =
            Texture { size_px, rgba8: decoded.into_rgba8().into_raw(), encoding: Encoding::Srgb };
        if has_alpha {
            texture.bleed_into_transparent();
        } else {
            // An unused alpha must not weight colours in mip levels.
            texture.rgba8.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
        }
        let texture = Arc::new(texture);
        self.textures.insert(key, texture.clone());
        Ok(texture)
    }
}

impl VertexRule {
    /// Whether there is a texture.
    pub fn has_texture(&self) -> bool {
        self.scale != [0.0; 2]
    }

    /// Texture coordinates after `KHR_texture_transform`.
    pub fn transform_uv(&self, [u, v]: [f64; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let (u, v) = (u * self.scale[0], v * self.scale[1]);
        [self.offset[0] + cos * u + sin * v, self.offset[1] - sin * u + cos * v].map(|x| x as f32)
    }
}
