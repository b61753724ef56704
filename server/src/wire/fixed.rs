//! Arrays of a fixed length: vectors, quaternions and triangles.
//!
//! Contract: exactly so many numbers; a shorter or a longer array is an error that says how many there should be.

use std::fmt;

use serde::de::{Error as _, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ArrayBuilder, Schema};
use utoipa::{PartialSchema, ToSchema};

macro_rules! fixed_array {
    ($(#[$doc:meta])* $name:ident, $item:ty, $length:literal, $expected:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name(pub [$item; $length]);

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                self.0.serialize(serializer)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Items;
                impl<'de> Visitor<'de> for Items {
                    type Value = [$item; $length];

                    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                        formatter.write_str($expected)
                    }

                    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
                        let mut array = [<$item>::default(); $length];
                        for (index, place) in array.iter_mut().enumerate() {
                            *place = items
                                .next_element()?
                                .ok_or_else(|| A::Error::invalid_length(index, &self))?;
                        }
                        let mut length = $length;
                        while items.next_element::<IgnoredAny>()?.is_some() {
                            length += 1;
                        }
                        if length > $length {
                            return Err(A::Error::invalid_length(length, &self));
                        }
                        Ok(array)
                    }
                }
                deserializer.deserialize_seq(Items).map(Self)
            }
        }

        impl PartialSchema for $name {
            fn schema() -> RefOr<Schema> {
                ArrayBuilder::new()
                    .items(<$item>::schema())
                    .min_items(Some($length))
                    .max_items(Some($length))
                    .description(Some($expected))
                    .into()
            }
        }

        impl ToSchema for $name {}
    };
}

fixed_array!(
    /// Three numbers: x, y, z.
    Vector, f64, 3, "an array of 3 numbers: x, y, z"
);
fixed_array!(
    /// Four numbers: x, y, z, w.
    Quaternion, f64, 4, "an array of 4 numbers: x, y, z, w"
);
fixed_array!(
    /// Three indices of vertices, from 0.
    Triangle, usize, 3, "an array of 3 vertex indices from 0"
);
