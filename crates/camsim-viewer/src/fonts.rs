//! Glyphs that egui's own fonts lack, as those of Chinese, Japanese and Korean names: from a font of the
//! system, if there is one. None is carried along: they are larger than the whole program. Nothing is read
//! before a character asks for it, and what cannot be read is passed over.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, OnceLock},
};

use eframe::egui::{
    Context, FallbackRequest, FontData, FontFamily, FontInsert, FontPriority, FontProvider, InsertFontFamily,
};

/// Fonts that are tried for a character, at most.
const MOST: usize = 6;
/// Folders in folders that are looked into.
const DEPTH: usize = 5;
/// Files that are looked at, at most: nobody waits for a name longer than a moment.
const MOST_FILES: usize = 20_000;

/// Letters that fonts are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Script {
    /// Chinese characters, and what is written between them.
    Han,
    /// Japanese.
    Kana,
    /// Korean.
    Hangul,
    /// Any other.
    Other,
}

use Script::{Han, Hangul, Kana, Other};

/// Beginnings of file names, small letters, with what is in those fonts. The first that is there is tried
/// first.
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
/// Cuts that are not taken where there is a plain one.
const CUTS: &[&str] =
    &["bold", "black", "heavy", "light", "thin", "medium", "italic", "oblique", "mono", "condensed", "serif"];

/// Lets a window find them.
pub fn install(context: &Context) {
    install_from(context, folders());
}

fn install_from(context: &Context, folders: Vec<PathBuf>) {
    let found = Arc::new(Found { folders, fonts: OnceLock::new() });
    // egui takes the next one's font where that of the first has no such glyph.
    for place in 0..MOST {
        context.add_font_provider(Arc::new(Nth { found: found.clone(), place }));
    }
}

/// Where systems have their fonts.
fn folders() -> Vec<PathBuf> {
    let of =
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
        vec![of("HOME", "Library/Fonts")]
    } else if cfg!(windows) {
        vec![of("WINDIR", "Fonts"), of("LOCALAPPDATA", "Microsoft/Windows/Fonts")]
    } else {
        vec![of("XDG_DATA_HOME", "fonts"), of("HOME", ".local/share/fonts"), of("HOME", ".fonts")]
    };
    fixed.iter().map(PathBuf::from).chain(own.into_iter().flatten()).collect()
}

/// The fonts that there are, looked for once, when the first of them is needed.
struct Found {
    folders: Vec<PathBuf>,
    fonts: OnceLock<Vec<Font>>,
}

/// One of them, read when it is needed.
struct Font {
    path: PathBuf,
    scripts: &'static [Script],
    data: OnceLock<Option<FontData>>,
}

impl Found {
    /// The nth font that is made for a script.
    fn nth(&self, script: Script, place: usize) -> Option<&Font> {
        let fonts = self.fonts.get_or_init(|| search(&self.folders));
        fonts.iter().filter(|font| font.scripts.contains(&script)).nth(place)
    }
}

/// What egui asks, one for each font that may be tried.
struct Nth {
    found: Arc<Found>,
    place: usize,
}

impl FontProvider for Nth {
    fn font_for(&self, request: &FallbackRequest<'_>) -> Option<FontInsert> {
        let script = script_of(request.cluster.chars().next()?)?;
        let font = self.found.nth(script, self.place)?;
        let data =
            font.data.get_or_init(|| std::fs::read(&font.path).ok().map(FontData::from_owned)).clone()?;
        let families = [FontFamily::Proportional, FontFamily::Monospace];
        let families =
            families.map(|family| InsertFontFamily { family, priority: FontPriority::Lowest }).into();
        Some(FontInsert { name: font.path.display().to_string(), data, families })
    }
}

/// What kind of font a character is looked for in; `None` for what is in none.
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

/// The best file for each entry of the list, in its order.
fn search(folders: &[PathBuf]) -> Vec<Font> {
    let mut files = Vec::new();
    let mut left = MOST_FILES;
    folders.iter().for_each(|folder| list(folder, DEPTH, &mut left, &mut files));
    let name =
        |path: &Path| path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    let named: Vec<(String, PathBuf)> = files.into_iter().map(|path| (name(&path), path)).collect();
    let best = |start: &str| {
        let of_start = named.iter().filter(|(name, _)| name.starts_with(start));
        of_start.min_by_key(|(name, path)| {
            (CUTS.iter().filter(|cut| name[start.len()..].contains(*cut)).count(), name.len(), path)
        })
    };
    let fonts = FONTS.iter().filter_map(|(start, scripts)| Some((best(start)?.1.clone(), *scripts)));
    fonts.map(|(path, scripts)| Font { path, scripts, data: OnceLock::new() }).collect()
}

/// Font files in a folder and in those below it.
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

    fn names(fonts: &[Font]) -> Vec<String> {
        fonts
            .iter()
            .map(|font| font.path.file_name().expect("a name").to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn the_plain_cut_of_the_font_with_most_letters_comes_first() {
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
        let found = Found { folders: vec![folder.path().into()], fonts: OnceLock::new() };
        let nth =
            |script, place| found.nth(script, place).map(|font| names(std::slice::from_ref(font))[0].clone());
        assert_eq!(nth(Hangul, 1).as_deref(), Some("malgun.ttf"));
        assert!(nth(Han, 1).is_none() && nth(Other, 0).is_none());
    }

    #[test]
    fn characters_are_looked_for_where_they_may_be() {
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

    /// A window whose system has its fonts in a folder, and whether it has glyphs.
    fn has(folders: Vec<PathBuf>, text: &str) -> bool {
        let context = Context::default();
        install_from(&context, folders);
        let mut has = false;
        let mut output = context.run_ui(RawInput::default(), |ui| {
            ui.label(text);
            has = ui.ctx().fonts_mut(|fonts| fonts.has_glyphs(&FontId::proportional(14.0), text));
        });
        // Nobody draws it.
        output.textures_delta.clear();
        has
    }

    #[test]
    fn what_is_no_font_or_has_no_such_glyph_is_passed_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "\u{98db}\u{884c}\u{d55c}\u{30ab}";
        assert!(!has(vec![folder.path().into()], text), "nothing there");
        std::fs::write(folder.path().join("NotoSansCJK-Regular.ttc"), "no font").expect("written");
        let latin = eframe::egui::FontDefinitions::default().font_data["Ubuntu-Light"].clone();
        let latin: &[u8] = (*latin.font).as_ref();
        std::fs::write(folder.path().join("wqy-zenhei.ttc"), latin).expect("written");
        assert!(!has(vec![folder.path().into()], text), "and nothing that breaks");
    }

    #[test]
    fn a_font_of_the_system_has_what_its_name_says() {
        // Of Droid's fallback there are cuts without Korean.
        for (text, script) in
            [("\u{98db}\u{884c}", Han), ("\u{30ab}\u{30e1}\u{30e9}", Kana), ("\u{531}", Other)]
        {
            let found = Found { folders: folders(), fonts: OnceLock::new() };
            // Not every machine has one.
            if found.nth(script, 0).is_some() {
                assert!(
                    has(folders(), text),
                    "{text} in none of {:?}",
                    names(found.fonts.get().expect("looked for"))
                );
            }
        }
    }
}
