#![allow(clippy::unwrap_used)]

use super::*;

/// A `.npy` file of version 1, with the padding of NumPy.
pub(in crate::frame_file) fn npy(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes(), data].concat()
}

fn bytes<const N: usize, T: Copy>(values: &[T], to_bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|value| to_bytes(*value)).collect()
}

#[test]
fn element_types_byte_orders_and_axis_orders_are_read() {
    let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let integers: [u16; 6] = [1, 2, 3, 4, 5, 6];
    for (descr, data, is_whole) in [
        ("<f4", bytes(&values, |v| (v as f32).to_le_bytes()), false),
        (">f4", bytes(&values, |v| (v as f32).to_be_bytes()), false),
        ("<f8", bytes(&values, f64::to_le_bytes), false),
        (">f8", bytes(&values, f64::to_be_bytes), false),
        ("<f2", bytes(&values, |v| f16::from_f64(v).to_le_bytes()), false),
        ("<u2", bytes(&integers, u16::to_le_bytes), true),
        (">u2", bytes(&integers, u16::to_be_bytes), true),
        ("<i4", bytes(&integers, |v| i32::from(v).to_le_bytes()), true),
        (">i8", bytes(&integers, |v| i64::from(v).to_be_bytes()), true),
    ] {
        let array = parse(&npy(descr, false, "(2, 3)", &data)).unwrap();
        assert_eq!(
            (array.values, array.is_integer, &array.shape[..]),
            (values.to_vec(), is_whole, &[2, 3][..]),
            "{descr}"
        );
    }
    // Column-major order: 1 4, 2 5, 3 6.
    let by_columns = bytes(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0], f64::to_le_bytes);
    assert_eq!(parse(&npy("<f8", true, "(2, 3)", &by_columns)).unwrap().values, values);
    assert_eq!(parse(&npy("<f8", true, "(2, 3, 1)", &by_columns)).unwrap().values, values);
    // Column-major order of three axes.
    let cube: Vec<f64> = (0..24).map(f64::from).collect();
    let values = parse(&npy("<f8", true, "(2, 3, 4)", &bytes(&cube, f64::to_le_bytes))).unwrap().values;
    assert_eq!((values[0], values[1], values[4], values[12]), (0.0, 6.0, 2.0, 1.0));
}

#[test]
fn headers_of_version_2_are_read() {
    let first = npy("<f4", false, "(1, 1)", &1.5_f32.to_le_bytes());
    let second = [b"\x93NUMPY\x02\x00".as_slice(), &(first[8..10]), &[0, 0], &first[10..]].concat();
    assert_eq!(parse(&second).unwrap().values, [1.5]);
}

#[test]
fn unusable_arrays_are_refused() {
    let data = [0; 24];
    for (file, wanted) in [
        (npy("|O", false, "(2, 3)", &data), "elements `|O`"),
        (npy("<c8", false, "(3,)", &data), "elements `<c8`"),
        (npy("|u1", false, "(24,)", &data), "elements `|u1`"),
        (npy("<f4", false, "(2, 4)", &data), "it is cut off or damaged"),
        (npy("<f4", false, "(2, 2)", &data), "it is cut off or damaged"),
        (npy("<f4", false, "()", &data), "it is cut off or damaged"),
        (npy("<f4", false, "(0, 3)", &[]), "that is no picture"),
        (npy("<f4", false, "(99999999999, 99999999999)", &data), "that is no picture"),
        (npy("<f4", false, "(2, x)", &data), "has no shape"),
        (b"\x93NUMPY\x01\x00\xff\xff{'descr'".to_vec(), "ends within its header"),
        (b"\x93NUMPY".to_vec(), "ends within its header"),
    ] {
        let message = parse(&file).unwrap_err();
        assert!(message.contains(wanted), "{message}\n  not {wanted}");
    }
    let structured = [
        b"\x93NUMPY\x01\x00\x3a\x00".as_slice(),
        b"{'descr': [('z', '<f4')], 'fortran_order': False, 'shape': (2,)}",
    ]
    .concat();
    assert!(parse(&structured).unwrap_err().contains("has no descr"));
    let plane =
        |shape: &[usize]| NpyArray { shape: shape.to_vec(), values: Vec::new(), is_integer: false }.plane();
    assert_eq!([plane(&[4, 5]), plane(&[4, 5, 1]), plane(&[1, 4, 5])], [Ok([5, 4]), Ok([5, 4]), Ok([5, 4])]);
    assert!(plane(&[4, 5, 3]).unwrap_err().contains("shape [4, 5, 3]") && plane(&[20]).is_err());
}
