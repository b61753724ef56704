//! The checksum of a message's body: CRC-64 of ECMA-182 (polynomial 0x42F0E1EBA9EA3693, most significant bit first, beginning with zero).

/// The polynomial without its highest term.
const POLYNOMIAL: u64 = 0x42f0_e1eb_a9ea_3693;

/// What each byte adds.
const TABLE: [u64; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut rest, mut bit) = ((byte as u64) << 56, 0);
        while bit < 8 {
            let carried = rest >> 63 == 1;
            rest <<= 1;
            if carried {
                rest ^= POLYNOMIAL;
            }
            bit += 1;
        }
        table[byte] = rest;
        byte += 1;
    }
    table
};

/// The checksum of these bytes.
pub fn crc64(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |sum, byte| (sum << 8) ^ TABLE[(sum >> 56) as usize ^ usize::from(*byte)])
}
