//! Bytes that are nearly in order: a seed with some of it changed, cut, repeated, or crossed with another.

use fastrand::Rng;

/// Most changes of one input.
const MOST_CHANGES: usize = 6;

/// Longest piece that is cut or repeated at once.
const LONGEST_PIECE: usize = 64;

/// What often brings readers down.
const TOKENS: [&[u8]; 22] = [
    b"NaN",
    b"inf",
    b"1e999",
    b"-1",
    b"0",
    b"4294967295",
    b"18446744073709551615",
    b"-9223372036854775808",
    b"9007199254740993",
    b"5e-324",
    b"null",
    b"{}",
    b"[]",
    b"\"",
    b"\\ud800",
    b"\n",
    b"\r\n",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80",
    b"\x00\x00\xc0\x7f",
    b"solid",
    b"end_header\n",
];

/// An input made of these seeds, at least one.
pub fn mutated(rng: &mut Rng, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seeds[rng.usize(0..seeds.len())].clone();
    for _ in 0..rng.usize(1..=MOST_CHANGES) {
        change(rng, &mut bytes, seeds);
    }
    bytes
}

fn change(rng: &mut Rng, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    let at = rng.usize(0..=bytes.len());
    let piece = at..bytes.len().min(at + rng.usize(0..LONGEST_PIECE));
    match rng.u8(0..8) {
        0 if at < bytes.len() => bytes[at] ^= 1 << rng.u8(0..8),
        1 if at < bytes.len() => bytes[at] = rng.u8(..),
        2 => drop(bytes.drain(piece)),
        3 => {
            let repeated = bytes[piece].to_vec();
            bytes.splice(at..at, repeated);
        }
        4 => bytes.truncate(at),
        5 => {
            let other = &seeds[rng.usize(0..seeds.len())];
            let from = rng.usize(0..=other.len());
            bytes.truncate(at);
            bytes.extend_from_slice(&other[from..]);
        }
        6 => number(rng, bytes),
        _ => {
            let token = TOKENS[rng.usize(0..TOKENS.len())];
            let end = if rng.bool() { at } else { bytes.len().min(at + token.len()) };
            bytes.splice(at..end, token.iter().copied());
        }
    }
}

/// Puts another number in the place of one that is written out.
fn number(rng: &mut Rng, bytes: &mut Vec<u8>) {
    let is_digit = |byte: &u8| byte.is_ascii_digit();
    let starts: Vec<usize> =
        (0..bytes.len()).filter(|&at| is_digit(&bytes[at]) && (at == 0 || !is_digit(&bytes[at - 1]))).collect();
    let Some(&start) = starts.get(rng.usize(0..starts.len().max(1))) else { return };
    let length = bytes[start..].iter().take_while(|byte| is_digit(byte)).count();
    let text = match rng.u8(0..4) {
        0 => rng.i64(..).to_string(),
        1 => format!("{:e}", f64::from_bits(rng.u64(..))),
        2 => rng.u8(0..6).to_string(),
        _ => format!("{}", rng.f64() * 10.0),
    };
    bytes.splice(start..start + length, text.into_bytes());
}
