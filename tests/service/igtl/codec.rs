//! The bytes of OpenIGTLink: known vectors, and laws of the codec.

use proptest::prelude::*;
use retina_server::igtl::axes::{Axes, quaternion};
use retina_server::igtl::content;
use retina_server::igtl::crc::crc64;
use retina_server::igtl::frame::{Broken, Codec, Damage, Frame, LONGEST_BODY, LONGEST_SKIPPED, Stamp, encode};
use retina_server::igtl::unit::{MILLINEWTON, NEWTONS, in_millinewtons};
use retina_tests::igtl_client;
use tokio_util::bytes::BytesMut;
use tokio_util::codec::Decoder as _;

/// The reference library's example of a TRANSFORM with a header of version 2 and two pairs of metadata (`igtl_test_data_transformFormat2.h`).
const EXAMPLE: &str = "0002 5452414e53464f524d000000 4465766963654e616d6500000000000000000000 00000000499602d4 0000000000000075 f698f64fdae266dd \
     000c 0012 00000027 00000001 \
     bf7473cd 3e4959e6 be63dd98 be4959e6 3e12491b 3f7852d6 3e63dd98 3f7852d6 bdc830ae 42383660 419bc467 42383660 \
     0002 0011 0003 00000002 0012 0003 00000002 \
     46697273742070617469656e7420616765 3232 5365636f6e642070617469656e7420616765 3235";

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u32> = hex.chars().filter_map(|digit| digit.to_digit(16)).collect();
    digits.chunks(2).map(|pair| (16 * pair[0] + pair[1]) as u8).collect()
}

/// Everything that comes of these pieces.
fn decode<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> Result<Vec<Result<Frame, Damage>>, Broken> {
    let (mut codec, mut buffer, mut found) = (Codec::default(), BytesMut::new(), Vec::new());
    for piece in pieces {
        buffer.extend_from_slice(piece);
        while let Some(message) = codec.decode(&mut buffer)? {
            found.push(message);
        }
    }
    Ok(found)
}

#[test]
fn the_checksum_is_that_of_ecma_182() {
    // The check value of the catalogue of parametrised CRC algorithms, CRC-64/ECMA-182.
    assert_eq!(crc64(b"123456789"), 0x6c40_df5f_0b49_7347);
    assert_eq!(crc64(b""), 0);
    let example = bytes(EXAMPLE);
    assert_eq!(crc64(&example[58..]), 0xf698_f64f_dae2_66dd);
    assert_eq!(crc64(&example[58..]), igtl_client::crc64(&example[58..]));
}

#[test]
fn the_reference_librarys_example_is_read() {
    let example = bytes(EXAMPLE);
    let found = decode([example.as_slice()]).expect("in step");
    let [Ok(frame)] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((frame.kind.as_str(), frame.device.as_str()), ("TRANSFORM", "DeviceName"));
    assert_eq!(frame.stamp, Stamp { version: 2, time: 1_234_567_892, message_id: 1 });
    let transform = content::transform(&frame.content).expect("a transform");
    // The example's comments: position 46.0531, 19.4709, 46.0531.
    assert_eq!(transform.translation_mm.map(|mm| (mm * 1e4).round() / 1e4), [46.0531, 19.4709, 46.0531]);
}

#[test]
fn a_unit_is_a_force_or_none() {
    // PREFIX milli 0xB, UNIT0 newton 0x0B, EXP0 1.
    assert_eq!(MILLINEWTON, 0xb << 60 | 0x0b << 54 | 1 << 50);
    assert_eq!(in_millinewtons(MILLINEWTON), Some(1.0));
    assert_eq!(in_millinewtons(NEWTONS), Some(1e3));
    for not_a_force in [
        0,
        0xb << 60 | 0x01 << 54 | 1 << 50,
        0xb << 60 | 0x0b << 54 | 2 << 50,
        MILLINEWTON | 1 << 40,
        0xf << 60 | NEWTONS,
    ] {
        assert_eq!(in_millinewtons(not_a_force), None, "{not_a_force:#x}");
    }
}

#[test]
fn a_matrix_that_is_no_rotation_has_no_quaternion() {
    let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(quaternion(upright), Some([0.0, 0.0, 0.0, 1.0]));
    let mirrored = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
    let scaled = upright.map(|column: [f64; 3]| column.map(|number| 1.01 * number));
    let sheared = [[1.0, 0.0, 0.0], [0.1, 0.995, 0.0], [0.0, 0.0, 1.0]];
    for wrong in [mirrored, scaled, sheared, [[0.0; 3]; 3]] {
        assert_eq!(quaternion(wrong), None, "{wrong:?}");
    }
}

#[test]
fn lengths_beyond_the_bounds_are_skipped_or_end_it() {
    let stamp = Stamp { version: 1, ..Stamp::default() };
    let long = encode(&stamp, "IMAGE", "Camera", &vec![7; LONGEST_BODY + 1]);
    let next = encode(&stamp, "STRING", "Next", &[0, 3, 0, 1, b'x']);
    let found = decode(long.chunks(5000).chain([next.as_slice()])).expect("in step");
    let [Err(Damage::TooLong { kind, .. }), Ok(frame)] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!((kind.as_str(), frame.device.as_str()), ("IMAGE", "Next"));
    let mut endless = next.clone();
    endless[42..50].copy_from_slice(&(LONGEST_SKIPPED + 1).to_be_bytes());
    assert!(matches!(decode([endless.as_slice()]), Err(Broken::Size(_))));
    let mut foreign = next;
    foreign[1] = 3;
    assert!(matches!(decode([foreign.as_slice()]), Err(Broken::Version(3))));
}

proptest! {
    #[test]
    fn what_is_written_is_read_however_it_is_cut(
        version in 1u16..=2,
        time: u64,
        number: u32,
        contents in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..300), 1..4),
        cuts in prop::collection::vec(1usize..200, 1..20),
    ) {
        let stamp = Stamp { version, time, message_id: if version == 2 { number } else { 0 } };
        let all: Vec<u8> = contents.iter().flat_map(|content| encode(&stamp, "STRING", "Device", content)).collect();
        let (mut pieces, mut rest, mut cuts) = (Vec::new(), all.as_slice(), cuts.iter().cycle());
        while !rest.is_empty() {
            let (piece, after) = rest.split_at(rest.len().min(*cuts.next().expect("endless")));
            pieces.push(piece);
            rest = after;
        }
        let found = decode(pieces).expect("in step");
        prop_assert_eq!(found.len(), contents.len());
        for (found, content) in found.into_iter().zip(contents) {
            let expected = Frame { stamp, kind: "STRING".to_owned(), device: "Device".to_owned(), content };
            prop_assert_eq!(found, Ok(expected));
        }
    }

    #[test]
    fn a_bit_that_falls_over_in_a_body_is_seen(content in prop::collection::vec(any::<u8>(), 1..200), at: prop::sample::Index, bit in 0u8..8) {
        let mut message = encode(&Stamp { version: 1, ..Stamp::default() }, "STRING", "Device", &content);
        let place = 58 + at.index(content.len());
        message[place] ^= 1 << bit;
        let found = decode([message.as_slice()]).expect("in step");
        prop_assert!(matches!(found.as_slice(), [Err(Damage::Checksum { .. })]), "{:?}", found);
    }

    #[test]
    fn any_bytes_are_read_without_a_panic(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        // Only that there is an end of it; what comes of it has its own tests.
        let _ = decode([noise.as_slice()]);
        let _ = (content::transform(&noise), content::sensor(&noise), content::string(&noise));
    }

    #[test]
    fn axes_turn_vectors_back_and_keep_rotations_right_handed(vector: [i16; 3], angle in 0.0f64..6.3) {
        let vector = vector.map(f64::from);
        for axes in [Axes::Ras, Axes::Lps] {
            prop_assert_eq!(axes.turn(axes.turn(vector)), vector);
        }
        let (sine, cosine) = angle.sin_cos();
        let columns = [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]];
        let turned = quaternion(Axes::Lps.turn_columns(columns));
        prop_assert!(turned.is_some(), "{columns:?}");
        // A turn by 180° about z after it: still about z.
        let [x, y, z, w] = turned.expect("a rotation");
        prop_assert!(x.abs() < 1e-12 && y.abs() < 1e-12 && (z * z + w * w - 1.0).abs() < 1e-12);
    }
}
