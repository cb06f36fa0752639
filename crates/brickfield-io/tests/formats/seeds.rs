//! Writes fixtures as seeds for the fuzz targets, where BRICKFIELD_FUZZ_SEEDS names a folder.

use std::path::Path;

use brickfield_io::Format;

#[test]
fn seeds_for_fuzzing() {
    let Some(folder) = std::env::var_os("BRICKFIELD_FUZZ_SEEDS") else { return };
    let folder = Path::new(&folder);
    for case in crate::bad_input::cases() {
        let target = match Format::from_extension(Path::new(case.name)) {
            Some(Format::Nrrd) => "nrrd",
            Some(Format::MetaImage) => "metaimage",
            Some(Format::Nifti) => "nifti",
            Some(Format::Vti) => "vti",
            _ => "dicom",
        };
        write(folder, target, case.name, &case.good);
    }
    #[cfg(feature = "ome-zarr")]
    for (i, entries) in crate::ome_zarr::examples().iter().enumerate() {
        let entry = |(name, bytes): (&String, &Vec<u8>)| {
            [name.as_bytes(), b"\n", &(bytes.len() as u32).to_le_bytes(), bytes].concat()
        };
        let packed: Vec<u8> = entries.iter().flat_map(entry).collect();
        write(folder, "ome_zarr", &format!("{i}"), &packed);
    }
    #[cfg(feature = "tiff")]
    for (i, file) in crate::tiff::examples().iter().enumerate() {
        write(folder, "tiff", &format!("{i}.tif"), file);
    }
}

fn write(folder: &Path, target: &str, name: &str, bytes: &[u8]) {
    std::fs::create_dir_all(folder.join(target)).unwrap();
    std::fs::write(folder.join(target).join(name), bytes).unwrap();
}
