//! Several files as tiles of one terrain.

use std::path::Path;

use camsim_core::scenario::{FileList, TerrainSpec};
use camsim_io::raster::LoadedTerrain;

use super::{
    color, height_m, pixels,
    raster::{Tiff, Value},
    read,
};

/// Size of the whole grid.
const SIZE: [u32; 2] = [9, 7];

fn height(column: u32, row: u32) -> f32 {
    (100 + 3 * column + 2 * row + column * row % 7) as f32
}

fn color_of(column: u32, row: u32) -> [u8; 3] {
    [20 * column as u8, 30 * row as u8, 100]
}

/// Moves a file to a column and a row of the grid.
fn at(tiff: Tiff, [column, row]: [f64; 2]) -> Tiff {
    let corner = vec![0.0, 0.0, 0.0, 500_000.0 + 10.0 * column, 5_200_000.0 - 10.0 * row, 0.0];
    tiff.with(33922, Value::Double(corner))
}

fn heights([column, row]: [u32; 2], size: [u32; 2]) -> Tiff {
    at(Tiff::heights(size, |c, r| height(column + c, row + r)), [column, row].map(f64::from))
}

fn colors([column, row]: [u32; 2], size: [u32; 2]) -> Tiff {
    let tiff = Tiff::colors(size, 3, 2, |c, r, band| color_of(column + c, row + r)[usize::from(band)]);
    at(tiff, [column, row].map(f64::from))
}

/// Two tiles that meet, whose border is between the columns 3 and 4.
fn halves(of: fn([u32; 2], [u32; 2]) -> Tiff) -> [Tiff; 2] {
    [of([0, 0], [4, 7]), of([4, 0], [5, 7])]
}

fn write(folder: &Path, tiles: impl IntoIterator<Item = Tiff>) {
    for (tile, name) in tiles.into_iter().zip(["d.tif", "c.tif", "b.tif", "a.tif"]) {
        tile.write(&folder.join(name));
    }
}

fn read_tiles(dem: FileList, ortho: Option<FileList>) -> Result<LoadedTerrain, String> {
    read(&TerrainSpec { dem, ortho, ..TerrainSpec::default() }).map_err(|error| error.to_string())
}

fn read_folder(tiles: impl IntoIterator<Item = Tiff>) -> Result<LoadedTerrain, String> {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), tiles);
    read_tiles(folder.path().into(), None)
}

#[test]
fn tiles_give_the_surface_of_one_file() {
    let whole = read_folder([heights([0, 0], SIZE)]).unwrap();
    let four = |more: u32| {
        let [left, top] = [4 + more, 3 + more];
        [
            heights([0, 0], [left, top]),
            heights([4, 0], [5, top]),
            heights([0, 3], [left, 4]),
            heights([4, 3], [5, 4]),
        ]
    };
    // Tiles that meet, that share a column and a row of posts, and that share three.
    for tiles in [halves(heights).to_vec(), four(0).to_vec(), four(1).to_vec(), four(3).to_vec()] {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), tiles.clone());
        let file = |name: &str| folder.path().join(name);
        let names = ["a.tif", "b.tif", "c.tif", "d.tif"].map(file).into_iter().filter(|path| path.exists());
        let reversed: Vec<_> = names.clone().rev().collect();
        for list in
            [names.collect::<Vec<_>>().into(), reversed.into(), file("*.tif").into(), folder.path().into()]
        {
            let loaded = read_tiles(list, None).unwrap();
            assert_eq!((loaded.summary.size, &loaded.notes[..]), (SIZE, &[][..]));
            assert_eq!(loaded.summary.files.len(), tiles.len());
            for post in pixels(SIZE) {
                assert_eq!(
                    loaded.terrain.position_ned_m(0, post[0], post[1]),
                    whole.terrain.position_ned_m(0, post[0], post[1])
                );
            }
            // Nothing is open along the borders of tiles.
            assert_eq!((loaded.terrain.cells, loaded.terrain.void_cells), (whole.terrain.cells, 0));
        }
    }
}

#[test]
fn tiles_of_a_picture_are_one_picture() {
    let folder = tempfile::tempdir().unwrap();
    heights([0, 0], SIZE).write(&folder.path().join("heights.tif"));
    let tiles = folder.path().join("tiles");
    std::fs::create_dir(&tiles).unwrap();
    write(&tiles, halves(colors));
    let loaded = read_tiles(folder.path().join("heights.tif").into(), Some(tiles.into())).unwrap();
    assert_eq!((loaded.summary.outside_ortho, &loaded.notes[..]), (0, &[][..]));
    for pixel in pixels(SIZE) {
        assert_eq!(color(&loaded, pixel), color_of(pixel[0], pixel[1]), "{pixel:?}");
    }
}

#[test]
fn holes_and_differences_of_tiles_are_reported() {
    let loaded = read_folder([heights([0, 0], [4, 7]), heights([6, 0], [3, 7])]).unwrap();
    assert!(loaded.notes[0].contains("leave holes: 22.22 % of the rectangle"), "{:?}", loaded.notes);
    assert_eq!([3, 4, 5, 6].map(|c| height_m(&loaded, [c, 2]).is_some()), [true, false, false, true]);
    let higher = at(Tiff::heights([5, 7], |c, r| height(4 + c, r) + 2.5), [4.0, 0.0]);
    let loaded = read_folder([heights([0, 0], [5, 7]), higher]).unwrap();
    assert!(loaded.notes[0].contains("differ by up to 2.50 m at 7 of the posts"), "{:?}", loaded.notes);
    // The western tile counts, whatever its name.
    assert_eq!(height_m(&loaded, [4, 2]), Some(f64::from(height(4, 2))));
}

#[test]
fn tiles_that_do_not_fit_are_refused_with_a_command() {
    let [west, east] = halves(heights);
    let scaled = |metres: f64| east.clone().with(33550, Value::Double(vec![metres, metres, 0.0]));
    let feet = r#"<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">ft</Item></GDALMetadata>"#;
    for (other, wanted) in [
        (east.clone().with_keys(&[1024, 1, 1025, 1, 3072, 32633]), "gdalwarp -t_srs EPSG:32632"),
        (scaled(5.0), "its pixels are 5 x 5 wide, but those of"),
        (at(east.clone(), [4.4, 0.0]), "its pixels lie 0.40 pixels off those of"),
        (at(east.clone(), [4.7, 0.0]), "its pixels lie 0.30 pixels off those of"),
        (at(east.clone(), [1e6, 1e6]), "its tiles lie far apart"),
        (east.clone().with_metadata(feet), "has heights in units of 1 m, but those of"),
    ] {
        let error = read_folder([west.clone(), other]).map(|loaded| loaded.notes).unwrap_err();
        assert!(error.contains(wanted), "{error}\n  lacks {wanted}");
    }
    let of_datum =
        |tile: &Tiff, code: u16| tile.clone().with_keys(&[1024, 1, 1025, 1, 3072, 32632, 4096, code]);
    let mixed = read_folder([of_datum(&west, 5030), of_datum(&east, 5703)]);
    let error = mixed.map(|loaded| loaded.notes).unwrap_err();
    assert!(error.contains("states heights above the ellipsoid, but"), "{error}");
    // One that states nothing may have the datum of the other.
    let notes = read_folder([west.clone(), of_datum(&east, 5703)]).unwrap().notes;
    assert!(notes.len() == 1 && notes[0].contains("c.tif: states heights above sea level"), "{notes:?}");
    let folder = tempfile::tempdir().unwrap();
    let error = |name: &str| {
        let list = vec![folder.path().join("d.tif"), folder.path().join(name)];
        read_tiles(list.into(), None).map(|loaded| loaded.notes).unwrap_err()
    };
    write(folder.path(), [west]);
    assert!(error("e.tif").contains("e.tif"), "{}", error("e.tif"));
    assert!(error("north*.tif").contains("north*.tif: no file fits it"), "{}", error("north*.tif"));
}
