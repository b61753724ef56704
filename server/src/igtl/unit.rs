//! The unit of a SENSOR in 64 bits: a prefix (4 bits) and up to six units (6 bits) with their exponents (4 bits), from the top.
//! Source: OpenIGTLink, `Documents/Protocol/unit.md`.

/// Millinewtons.
pub const MILLINEWTON: u64 = unit(MILLI, NEWTON);

/// Millimetres.
pub const MILLIMETRE: u64 = unit(MILLI, METRE);

/// Micrometres.
pub const MICROMETRE: u64 = unit(MICRO, METRE);

/// Newtons.
pub const NEWTONS: u64 = unit(NONE, NEWTON);

const METRE: u64 = 0x01;
const NEWTON: u64 = 0x0b;
const NONE: u64 = 0x0;
const MILLI: u64 = 0xb;
const MICRO: u64 = 0xc;
const EXPONENT_ONE: u64 = 0x1;

/// Prefixes: number, power of ten.
const PREFIXES: [(u64, i32); 7] = [(NONE, 0), (0x9, -1), (0xa, -2), (MILLI, -3), (MICRO, -6), (0xd, -9), (0x3, 3)];

/// Where the prefix, the first unit and its exponent begin.
const SHIFTS: (u32, u32, u32) = (60, 54, 50);

const fn unit(prefix: u64, unit: u64) -> u64 {
    prefix << SHIFTS.0 | unit << SHIFTS.1 | EXPONENT_ONE << SHIFTS.2
}

/// How many millinewtons one of this unit is, if it is a force.
pub fn in_millinewtons(unit: u64) -> Option<f64> {
    let (prefix, rest) = (unit >> SHIFTS.0, unit & !(0xf << SHIFTS.0));
    let power = PREFIXES.iter().find(|(number, _)| *number == prefix).map(|(_, power)| *power)?;
    (rest == NEWTONS).then(|| 10f64.powi(power + 3))
}
