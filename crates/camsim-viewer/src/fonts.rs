//! Fallback fonts of the system for glyphs that egui's fonts lack, such as Chinese, Japanese and Korean ones.
//! None is bundled: such fonts are larger than the program. Fonts are read when a character needs them;
//! unreadable ones are skipped.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, OnceLock},
};

use eframe::egui::{
    Context, FallbackRequest, FontData, FontFamily, FontInsert, FontPriority, FontProvider, InsertFontFamily,
};

/// Fonts tried for a character, at most.
const MAX_FALLBACKS: usize = 6;
/// Depth of the search for fonts in folders.
const MAX_DEPTH: usize = 5;
/// Files visited by the search, at most, to bound its time.
const MAX_FILES: usize = 20_000;

/// Scripts that fallback fonts cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Script {
    /// Chinese characters and CJK punctuation.
    Han,
    /// Japanese.
    Kana,
    /// Korean.
    Hangul,
    /// Any other.
    Other,
}

use Script::{Han, Hangul, Kana, Other};

/// Prefixes of file names, lower case, with the scripts of the fonts, in order of preference.
const FONTS: &[(&str, &[Script])] = &[
    ("notosanscjk", &[Han, Kana, Hangul]),
    ("sourcehansans", &[Han, Kana, Hangul]),
    ("droidsansfallback", &[Han, Kana, Hangul]),
    ("wqy-microhei", &[Han, Kana, Hangul]),
    ("wqy-zenhei", &[Han, Kana, Hangul]),
    ("arial unicode", &[Han, Kana, Hangul, Other]),
    ("notosanssc", &[Han, Kana]),
    ("notosanstc", &[Han, Kana]),
    ("notosansjp", &[Han, Kana]),
    ("notosanskr", &[Han, Hangul]),
    ("pingfang", &[Han, Kana]),
    ("hiragino sans gb", &[Han, Kana]),
    ("stheiti", &[Han, Kana]),
    (
        "\u{30d2}\u{30e9}\u{30ad}\u{3099}\u{30ce}\u{89d2}\u{30b3}\u{3099}\u{30b7}\u{30c3}\u{30af} w3",
        &[Han, Kana],
    ),
    ("\u{30d2}\u{30e9}\u{30ae}\u{30ce}\u{89d2}\u{30b4}\u{30b7}\u{30c3}\u{30af} w3", &[Han, Kana]),
    ("applesdgothicneo", &[Hangul]),
    ("applegothic", &[Hangul]),
    ("msyh", &[Han, Kana]),
    ("yugothm", &[Han, Kana]),
    ("yugothr", &[Han, Kana]),
    ("meiryo", &[Han, Kana]),
    ("msgothic", &[Han, Kana]),
    ("simsun", &[Han, Kana]),
    ("msjh", &[Han, Kana]),
    ("malgun", &[Hangul]),
    ("ipag", &[Han, Kana]),
    ("takaogothic", &[Han, Kana]),
    ("vl-gothic", &[Han, Kana]),
    ("uming", &[Han, Kana]),
    ("nanumgothic", &[Hangul]),
    ("baekmuk", &[Hangul]),
    ("unifont", &[Han, Kana, Hangul, Other]),
    ("dejavusans", &[Other]),
    ("notosans-regular", &[Other]),
    ("freesans", &[Other]),
    ("segoeui", &[Other]),
    ("lucidagrande", &[Other]),
];
/// Words of styles that are avoided if there is a regular font.
const STYLES: &[&str] =
    &["bold", "black", "heavy", "light", "thin", "medium", "italic", "oblique", "mono", "condensed", "serif"];

/// Registers the fallback fonts with egui.
pub fn install(context: &Context) {
    install_from(context, folders());
}

fn install_from(context: &Context, folders: Vec<PathBuf>) {
    let fonts = Arc::new(SystemFonts { folders, fonts: OnceLock::new() });
    // egui asks the next provider if the font of the first lacks the glyph.
    for index in 0..MAX_FALLBACKS {
        context.add_font_provider(Arc::new(FallbackProvider { fonts: fonts.clone(), index }));
    }
}

/// Font folders of the operating system.
fn folders() -> Vec<PathBuf> {
    let folder_in =
        |variable: &str, below: &str| std::env::var_os(variable).map(|folder| Path::new(&folder).join(below));
    let fixed: &[&str] = if cfg!(target_os = "macos") {
        &["/System/Library/Fonts", "/Library/Fonts", "/System/Library/AssetsV2/com_apple_MobileAsset_Font7"]
    } else if cfg!(windows) {
        &[]
    } else {
        &[
            "/usr/share/fonts",
            "/usr/local/share/fonts",
            "/run/host/fonts",
            "/run/current-system/sw/share/X11/fonts",
        ]
    };
    let own = if cfg!(target_os = "macos") {
        vec![folder_in("HOME", "Library/Fonts")]
    } else if cfg!(windows) {
        vec![folder_in("WINDIR", "Fonts"), folder_in("LOCALAPPDATA", "Microsoft/Windows/Fonts")]
    } else {
        vec![
            folder_in("XDG_DATA_HOME", "fonts"),
            folder_in("HOME", ".local/share/fonts"),
            folder_in("HOME", ".fonts"),
        ]
    };
    fixed.iter().map(PathBuf::from).chain(own.into_iter().flatten()).collect()
}

/// Fonts of the system, searched once, when first needed.
struct SystemFonts {
    folders: Vec<PathBuf>,
    fonts: OnceLock<Vec<FontFile>>,
}

/// A font file, read when first needed.
struct FontFile {
    path: PathBuf,
    scripts: &'static [Script],
    data: OnceLock<Option<FontData>>,
}

impl SystemFonts {
    /// The nth font that covers a script.
    fn nth(&self, script: Script, index: usize) -> Option<&FontFile> {
        let fonts = self.fonts.get_or_init(|| search(&self.folders));
        fonts.iter().filter(|font| font.scripts.contains(&script)).nth(index)
    }
}

/// Provider of the fallback font with a given index.
struct FallbackProvider {
    fonts: Arc<SystemFonts>,
    index: usize,
}

impl FontProvider for FallbackProvider {
    fn font_for(&self, request: &FallbackRequest<'_>) -> Option<FontInsert> {
        let script = script_of(request.cluster.chars().next()?)?;
        let font = self.fonts.nth(script, self.index)?;
        let data =
            font.data.get_or_init(|| std::fs::read(&font.path).ok().map(FontData::from_owned)).clone()?;
        let families = [FontFamily::Proportional, FontFamily::Monospace];
        let families =
            families.map(|family| InsertFontFamily { family, priority: FontPriority::Lowest }).into();
        Some(FontInsert { name: font.path.display().to_string(), data, families })
    }
}

/// The script of a character; `None` for ASCII and private use.
fn script_of(character: char) -> Option<Script> {
    Some(match character {
        '\0'..='\u{7f}' | '\u{e000}'..='\u{f8ff}' => return None,
        '\u{1100}'..='\u{11ff}'
        | '\u{3130}'..='\u{318f}'
        | '\u{a960}'..='\u{a97f}'
        | '\u{ac00}'..='\u{d7ff}' => Hangul,
        '\u{3040}'..='\u{30ff}' | '\u{31f0}'..='\u{31ff}' | '\u{ff66}'..='\u{ff9f}' => Kana,
        '\u{2e80}'..='\u{303f}'
        | '\u{3100}'..='\u{9fff}'
        | '\u{f900}'..='\u{faff}'
        | '\u{fe30}'..='\u{fe4f}'
        | '\u{ff00}'..='\u{ffef}' => Han,
        '\u{20000}'..='\u{3ffff}' => Han,
        _ => Other,
    })
}

/// The best file for each entry of [`FONTS`], in its order.
fn search(folders: &[PathBuf]) -> Vec<FontFile> {
    let mut files = Vec::new();
    let mut left = MAX_FILES;
    folders.iter().for_each(|folder| list(folder, MAX_DEPTH, &mut left, &mut files));
    let name =
        |path: &Path| path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    let named: Vec<(String, PathBuf)> = files.into_iter().map(|path| (name(&path), path)).collect();
    let best = |start: &str| {
        let matching = named.iter().filter(|(name, _)| name.starts_with(start));
        matching.min_by_key(|(name, path)| {
            (STYLES.iter().filter(|style| name[start.len()..].contains(*style)).count(), name.len(), path)
        })
    };
    let fonts = FONTS.iter().filter_map(|(start, scripts)| Some((best(start)?.1.clone(), *scripts)));
    fonts.map(|(path, scripts)| FontFile { path, scripts, data: OnceLock::new() }).collect()
}

/// Lists font files in a folder and below it.
fn list(folder: &Path, depth: usize, left: &mut usize, into: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if *left == 0 {
            return;
        }
        *left -= 1;
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        if matches!(ending.as_deref(), Some("ttf" | "otf" | "ttc" | "otc")) {
            into.push(path);
        } else if depth > 0 && path.is_dir() {
            list(&path, depth - 1, left, into);
        }
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{FontId, RawInput};

    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn fonts_are_where_distributions_put_them() {
        let found = folders();
        assert!(["/usr/share/fonts", "/usr/local/share/fonts"].iter().all(|one| found.contains(&one.into())));
    }

    fn names(fonts: &[FontFile]) -> Vec<String> {
        fonts
            .iter()
            .map(|font| font.path.file_name().expect("a name").to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn regular_styles_of_wide_fonts_come_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let put = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, "no font").expect("written");
        };
        put("truetype/malgunbd.ttf");
        put("truetype/malgun.ttf");
        put("opentype/noto/NotoSansCJK-Bold.ttc");
        put("opentype/noto/NotoSansCJK-Regular.ttc");
        put("opentype/noto/NotoSerifCJK-Regular.ttc");
        put("opentype/noto/NotoSansCJK-Regular.txt");
        put("a/b/c/d/e/f/g/wqy-zenhei.ttc");
        let fonts = search(&[folder.path().join("gone"), folder.path().into()]);
        assert_eq!(names(&fonts), ["NotoSansCJK-Regular.ttc", "malgun.ttf"]);
        let system_fonts = SystemFonts { folders: vec![folder.path().into()], fonts: OnceLock::new() };
        let nth = |script, index| {
            system_fonts.nth(script, index).map(|font| names(std::slice::from_ref(font))[0].clone())
        };
        assert_eq!(nth(Hangul, 1).as_deref(), Some("malgun.ttf"));
        assert!(nth(Han, 1).is_none() && nth(Other, 0).is_none());
    }

    #[test]
    fn characters_have_the_expected_script() {
        let expected = [
            ('\u{98db}', Some(Han)),
            ('\u{3002}', Some(Han)),
            ('\u{30ab}', Some(Kana)),
            ('\u{d55c}', Some(Hangul)),
        ];
        for (character, script) in
            expected.into_iter().chain([('a', None), ('\u{e000}', None), ('\u{531}', Some(Other))])
        {
            assert_eq!(script_of(character), script, "{character}");
        }
    }

    /// Whether a window with these font folders has glyphs for a text.
    fn has_glyphs(folders: Vec<PathBuf>, text: &str) -> bool {
        let context = Context::default();
        install_from(&context, folders);
        let mut has = false;
        let mut output = context.run_ui(RawInput::default(), |ui| {
            ui.label(text);
            has = ui.ctx().fonts_mut(|fonts| fonts.has_glyphs(&FontId::proportional(14.0), text));
        });
        // egui expects textures to be drawn.
        output.textures_delta.clear();
        has
    }

    #[test]
    fn files_that_are_no_font_or_lack_the_glyph_are_skipped() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "\u{98db}\u{884c}\u{d55c}\u{30ab}";
        assert!(!has_glyphs(vec![folder.path().into()], text), "no fonts");
        std::fs::write(folder.path().join("NotoSansCJK-Regular.ttc"), "no font").expect("written");
        let latin = eframe::egui::FontDefinitions::default().font_data["Ubuntu-Light"].clone();
        let latin: &[u8] = (*latin.font).as_ref();
        std::fs::write(folder.path().join("wqy-zenhei.ttc"), latin).expect("written");
        assert!(!has_glyphs(vec![folder.path().into()], text), "no usable font");
    }

    #[test]
    fn system_fonts_have_the_glyphs_of_their_scripts() {
        // Hangul is skipped: some versions of Droid Sans Fallback lack it.
        for (text, script) in
            [("\u{98db}\u{884c}", Han), ("\u{30ab}\u{30e1}\u{30e9}", Kana), ("\u{531}", Other)]
        {
            let system_fonts = SystemFonts { folders: folders(), fonts: OnceLock::new() };
            // Some machines have no such font.
            if system_fonts.nth(script, 0).is_some() {
                assert!(
                    has_glyphs(folders(), text),
                    "{text} in none of {:?}",
                    names(system_fonts.fonts.get().expect("searched"))
                );
            }
        }
    }
}
