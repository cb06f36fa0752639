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
            Some(Format::Mgh) => "mgh",
            Some(Format::Vti) => "vti",
            Some(Format::Vol) => "vol",
            Some(Format::VtkLegacy) => "vtk_legacy",
            _ => "dicom",
        };
        write(folder, target, case.name, &case.good);
    }
    for (i, file) in crate::vtk_legacy::examples().iter().enumerate() {
        write(folder, "vtk_legacy", &format!("{i}.vtk"), file);
    }
    #[cfg(feature = "vti")]
    for (compressor, file) in crate::vti::examples() {
        write(folder, "vti", &format!("{compressor}.vti"), &file);
    }
    #[cfg(feature = "vti")]
    write(folder, "pvti", "0", &packed(&crate::vti_pieces::parallel()));
    #[cfg(feature = "nifti")]
    for (i, file) in crate::nifti_kinds::examples().iter().enumerate() {
        write(folder, "nifti", &format!("{i}.nii"), file);
    }
    #[cfg(feature = "mgh")]
    for (i, file) in crate::mgh::examples().iter().enumerate() {
        write(folder, "mgh", &format!("{i}.mgh"), file);
    }
    for (i, file) in crate::vol::examples().iter().enumerate() {
        write(folder, "vol", &format!("{i}.vol"), file);
    }
    for (i, file) in crate::nrrd_axes::examples().iter().enumerate() {
        write(folder, "nrrd", &format!("{i}.nrrd"), file.as_bytes());
    }
    for (i, file) in crate::metaimage::examples().iter().enumerate() {
        write(folder, "metaimage", &format!("{i}.mha"), file.as_bytes());
    }
    for example in crate::grids::examples() {
        let (_, extension) = example.name.rsplit_once('.').unwrap_or_default();
        let target = match extension {
            "xyz" => "plot3d",
            "q" | "f" => "plot3d_values",
            "dem" => "usgs_dem",
            "tif" => "geotiff",
            "vtk" => "vtk_legacy_grid",
            _ => "vtk_xml_grid",
        };
        write(folder, target, example.name, &example.bytes);
    }
    #[cfg(feature = "ome-zarr")]
    for (i, entries) in crate::ome_zarr::examples().iter().chain(&crate::zarr_arrays::examples()).enumerate() {
        write(folder, "ome_zarr", &i.to_string(), &packed(entries));
    }
    #[cfg(feature = "tiff")]
    for (i, file) in crate::tiff::examples().iter().enumerate() {
        write(folder, "tiff", &format!("{i}.tif"), file);
    }
    #[cfg(feature = "tiff")]
    for (i, entries) in crate::tiff_ome::examples().iter().enumerate() {
        write(folder, "ome_tiff", &i.to_string(), &packed(entries));
    }
    #[cfg(any(feature = "tiff", feature = "png"))]
    for (i, entries) in crate::pictures::examples().iter().enumerate() {
        write(folder, "pictures", &i.to_string(), &packed(entries));
    }
}

/// Entries as targets that read several files take them.
#[cfg(any(feature = "ome-zarr", feature = "tiff", feature = "png", feature = "vti"))]
fn packed(entries: &std::collections::BTreeMap<String, Vec<u8>>) -> Vec<u8> {
    let entry = |(name, bytes): (&String, &Vec<u8>)| {
        [name.as_bytes(), b"\n", &(bytes.len() as u32).to_le_bytes(), bytes].concat()
    };
    entries.iter().flat_map(entry).collect()
}

fn write(folder: &Path, target: &str, name: &str, bytes: &[u8]) {
    std::fs::create_dir_all(folder.join(target)).unwrap();
    std::fs::write(folder.join(target).join(name), bytes).unwrap();
}
