//! Materials: base colour, what is emitted, holes, sides; and how texture coordinates reach the picture.

use std::{collections::HashMap, sync::Arc};

use camsim_core::scene::{Encoding, Material, Shape, Texture, Wrap};
use gltf::{
    material::AlphaMode,
    texture::{Info, MagFilter, WrappingMode},
};

use super::{
    GltfError,
    emitted::{self, Bake, Layer},
    source::Source,
};

/// From this alpha on a blended surface has depth: a pixel has one, that of the surface most of its light is
/// of.
const BLEND_CUTOFF: f32 = 0.5;
/// What has just the alpha of the cut-off is there: it must not be left to what corners' alphas, or half
/// floats of a picture's, round to.
const AT_CUTOFF: f32 = 1.0 - 5e-4;

/// How a primitive's corners meet its picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct UvRule {
    /// Which set of texture coordinates.
    pub set: u32,
    /// `KHR_texture_transform`: offset, rotation in radians, scale.
    pub offset: [f64; 2],
    pub rotation: f64,
    pub scale: [f64; 2],
    /// Factor of every corner's colour.
    pub factor: [f32; 4],
    /// Whether vertex colours count: of what is emitted they do not.
    pub vertex_colors: bool,
    /// Whether they should and cannot, as what is emitted is in the same picture.
    pub loses_colors: bool,
    /// Whether the scene's light falls on it: not on what is unlit by name or shines by itself.
    pub takes_light: bool,
}

/// A picture, its behaviour outside of it and whether its texels have sharp borders.
type Textured = (Arc<Texture>, [Wrap; 2], bool);

/// A file's materials and pictures, each read once.
#[derive(Debug)]
pub(super) struct Materials<'a> {
    source: &'a Source,
    white: Arc<Texture>,
    /// By image, and whether its alpha counts.
    textures: HashMap<(usize, bool), Arc<Texture>>,
    /// Of pictures with alpha that were asked, whether any of it is below 1.
    clear: HashMap<*const Texture, bool>,
    known: HashMap<Option<usize>, (Material, UvRule)>,
    /// Of those whose emitted light lies otherwise than their base colour.
    bakes: HashMap<Option<usize>, Bake>,
    pub notes: Vec<String>,
}

/// No adapter takes a larger side.
const LARGEST_PX: u32 = 32_768;
/// What adapters take at least, but for small ones.
const COMMON_PX: u32 = 16_384;
/// What is larger fills a device: a third of a gigabyte.
const LARGE_PX: u64 = 1 << 26;

impl<'a> Materials<'a> {
    pub fn new(source: &'a Source) -> Self {
        let white = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
        Self {
            source,
            white,
            textures: HashMap::new(),
            clear: HashMap::new(),
            known: HashMap::new(),
            bakes: HashMap::new(),
            notes: Vec::new(),
        }
    }

    pub fn of(&mut self, material: &gltf::Material<'_>) -> Result<(Material, UvRule), GltfError> {
        if let Some(known) = self.known.get(&material.index()) {
            return Ok(known.clone());
        }
        // What files from before metals and roughness call the diffuse colour is the base colour of what
        // shines in no other way.
        let (diffuse, base) = (material.pbr_specular_glossiness(), material.pbr_metallic_roughness());
        let (key, factor, base_texture) = match &diffuse {
            Some(of) => (
                "extensions.KHR_materials_pbrSpecularGlossiness.diffuseFactor",
                of.diffuse_factor(),
                of.diffuse_texture(),
            ),
            None => {
                ("pbrMetallicRoughness.baseColorFactor", base.base_color_factor(), base.base_color_texture())
            }
        };
        let strength = self.source.emissive_strength(material.index());
        let emitted = material.emissive_factor().map(|part| part * strength);
        let emitted_key =
            if strength == 1.0 { "emissiveFactor" } else { "emissiveFactor times emissiveStrength" };
        self.check_factors(material, [(key, &factor), (emitted_key, &emitted)])?;
        let emitted = emitted.map(|part| part.clamp(0.0, 1.0));
        // What is unlit has its base colour alone, by the definition of that.
        let emits = !material.unlit() && emitted.iter().any(|&part| part > 0.0);
        // Alpha is the base colour's, black or not.
        let has_alpha = material.alpha_mode() != AlphaMode::Opaque;
        let black = factor[..3].iter().all(|&part| part == 0.0) && !(has_alpha && base_texture.is_some());
        let mut rule = UvRule {
            set: 0,
            offset: [0.0; 2],
            rotation: 0.0,
            scale: [1.0; 2],
            factor,
            vertex_colors: true,
            loses_colors: false,
            takes_light: !material.unlit(),
        };
        let mut emissive = [0.0; 3];
        let mut on_top = None;
        let info = match (base_texture, material.emissive_texture()) {
            // Nothing but what is emitted.
            (_, Some(info)) if emits && black => {
                rule.factor = [emitted[0], emitted[1], emitted[2], factor[3]];
                rule.vertex_colors = false;
                rule.takes_light = false;
                Some(info)
            }
            (info, emissive_texture) => {
                if emits {
                    emissive = emitted;
                    if emissive_texture.is_some() {
                        emissive = [0.0; 3];
                    }
                    on_top = emissive_texture;
                }
                info
            }
        };
        let with_light = match &on_top {
            Some(light) => {
                self.with_light(material.index(), (info.as_ref(), light), has_alpha, emitted, &mut rule)?
            }
            None => None,
        };
        let (texture, wrap, nearest) = match (with_light, &info) {
            (Some(both), _) => both,
            (None, None) => {
                // Where there is no picture its coordinates are nothing to keep.
                rule.scale = [0.0; 2];
                (self.white.clone(), [Wrap::Repeat; 2], false)
            }
            // Of a picture of emitted light alpha does not count.
            (None, Some(info)) => self.textured(info, has_alpha && !(emits && black), &mut rule)?,
        };
        let cutoff = match material.alpha_mode() {
            AlphaMode::Opaque => None,
            AlphaMode::Mask => Some(material.alpha_cutoff().unwrap_or(0.5)),
            AlphaMode::Blend => Some(BLEND_CUTOFF),
        };
        let cutoff = cutoff.map(|alpha: f32| AT_CUTOFF * alpha);
        let blends = material.alpha_mode() == AlphaMode::Blend;
        let made = Material {
            texture,
            wrap,
            nearest,
            emissive,
            cutoff,
            blends,
            one_sided: !material.double_sided(),
        };
        self.known.insert(material.index(), (made.clone(), rule));
        Ok((made, rule))
    }

    /// Refuses factors that are no numbers, and says which are beyond what there is.
    fn check_factors(
        &mut self,
        material: &gltf::Material<'_>,
        factors: [(&str, &[f32]); 2],
    ) -> Result<(), GltfError> {
        let name = self.source.material_name(material.index());
        for (key, parts) in factors {
            if parts.iter().any(|part| !part.is_finite()) {
                return Err(self.source.broken(format!(
                    "{name}: {key} is {parts:?}, which is not finite: give numbers from 0 to 1"
                )));
            }
            if parts.iter().any(|part| !(0.0..=1.0).contains(part)) {
                self.notes.push(format!(
                    "{name}: {key} is {parts:?}: what is not within 0 to 1 is taken as the nearest that is"
                ));
            }
        }
        let cutoff = material.alpha_cutoff().unwrap_or(0.5);
        if cutoff.is_finite() {
            Ok(())
        } else {
            Err(self.source.broken(format!("{name}: alphaCutoff is {cutoff}, which is not finite")))
        }
    }

    /// The material on a shape: what is to be blended and has no alpha below 1 anywhere hides what is behind
    /// it, and is drawn as what does.
    pub fn on(&mut self, shape: &Shape, material: Material) -> Material {
        let texture = &material.texture;
        let is_clear = || texture.rgba8.chunks_exact(4).any(|pixel| pixel[3] < 255);
        let mixes = material.blends
            && (shape.vertices.iter().any(|vertex| vertex.tint[3] < 1.0)
                || *self.clear.entry(Arc::as_ptr(texture)).or_insert_with(is_clear));
        if material.blends && !mixes {
            Material { blends: false, cutoff: None, ..material }
        } else {
            material
        }
    }

    /// What is to be done to a shape of this material before it is shown.
    pub fn bake_of(&self, material: &gltf::Material<'_>) -> Option<Bake> {
        self.bakes.get(&material.index()).cloned()
    }

    /// The base colour with a picture of emitted light on top; `None` where they do not lie on each other, so
    /// that it takes a shape to say what does.
    fn with_light(
        &mut self,
        material: Option<usize>,
        (base, light): (Option<&Info<'_>>, &Info<'_>),
        has_alpha: bool,
        emitted: [f32; 3],
        rule: &mut UvRule,
    ) -> Result<Option<Textured>, GltfError> {
        let layer =
            |(texture, wrap, nearest): Textured, rule: UvRule| Layer::new(texture, wrap, nearest, rule);
        let mut of_light = *rule;
        let above = layer(self.textured(light, false, &mut of_light)?, of_light);
        let below = match base {
            Some(info) => layer(self.textured(info, has_alpha, rule)?, *rule),
            None => {
                *rule = of_light;
                Layer::new(self.white.clone(), above.wrap, above.nearest, of_light)
            }
        };
        let place =
            |of: &Layer| (of.rule.set, of.rule.offset, of.rule.rotation, of.rule.scale, of.wrap, of.nearest);
        let [r, g, b, alpha] = rule.factor;
        if place(&below) != place(&above) {
            self.bakes.insert(material, Bake { base: below, light: above, emitted });
            return Ok(None);
        }
        let both = emitted::on_top(&below, [r, g, b], &above, emitted);
        *rule = UvRule {
            factor: [1.0, 1.0, 1.0, alpha],
            vertex_colors: false,
            loses_colors: true,
            takes_light: false,
            ..*rule
        };
        Ok(Some((Arc::new(both), below.wrap, below.nearest)))
    }

    fn textured(
        &mut self,
        info: &Info<'_>,
        has_alpha: bool,
        rule: &mut UvRule,
    ) -> Result<Textured, GltfError> {
        rule.set = info.tex_coord();
        if let Some(transform) = info.texture_transform() {
            rule.set = transform.tex_coord().unwrap_or(rule.set);
            rule.offset = transform.offset().map(f64::from);
            rule.rotation = f64::from(transform.rotation());
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

    fn texture(&mut self, image: &gltf::Image<'_>, has_alpha: bool) -> Result<Arc<Texture>, GltfError> {
        let key = (image.index(), has_alpha);
        if let Some(texture) = self.textures.get(&key) {
            return Ok(texture.clone());
        }
        let bytes = self.source.image(image)?;
        let number = image.index();
        let wrong = |reason: String| self.source.broken(format!("images.{number}: {reason}"));
        let undecoded = |reason: String| {
            wrong(format!("cannot be decoded as PNG, JPEG or WebP: {reason}; write it as one of them"))
        };
        let [width, height] = crate::pictures::size_of_bytes(&bytes).map_err(undecoded)?;
        if width.max(height) > LARGEST_PX {
            return Err(wrong(format!(
                "is of {width}x{height} px, and at most {LARGEST_PX} on a side can be shown: make it smaller"
            )));
        }
        if width.max(height) > COMMON_PX || u64::from(width) * u64::from(height) > LARGE_PX {
            let mib = (u64::from(width) * u64::from(height) * 16 / 3).div_ceil(1 << 20);
            let sides = format!("many adapters take at most {COMMON_PX} on a side");
            self.notes
                .push(format!("images.{number}: is of {width}x{height} px, {mib} MiB of the device's memory: {sides}; smaller may do"));
        }
        let decoded = crate::pictures::decode_bytes(&bytes).map_err(undecoded)?;
        let size_px = [decoded.width(), decoded.height()];
        let mut texture =
            Texture { size_px, rgba8: decoded.into_rgba8().into_raw(), encoding: Encoding::Srgb };
        if has_alpha {
            texture.bleed_into_transparent();
        } else {
            // What does not count must not weigh colours either.
            texture.rgba8.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
        }
        let texture = Arc::new(texture);
        self.textures.insert(key, texture.clone());
        Ok(texture)
    }
}

impl UvRule {
    /// Whether there is a picture that coordinates matter for.
    pub fn has_picture(&self) -> bool {
        self.scale != [0.0; 2]
    }

    /// Texture coordinates of the picture.
    pub fn apply(&self, [u, v]: [f64; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let (u, v) = (u * self.scale[0], v * self.scale[1]);
        [self.offset[0] + cos * u + sin * v, self.offset[1] - sin * u + cos * v].map(|x| x as f32)
    }
}
