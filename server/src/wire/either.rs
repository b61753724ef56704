//! Fields that may be written in two ways: a name or an object, a word or a list, one object or several.
//!
//! Contract: the shape of the JSON decides, so an error inside either way keeps the path of the field that is wrong.
//!
//! Not here: derived untagged enums, which forget both the path and the reason.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer, StrDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::object::Object;
use super::request::{EffectsSpec, SceneChoice, TipName, TipShape, TipSpec};
use super::scene::{LayerSpec, RetinaSpec, SceneSpec};

struct SceneVisitor;

impl<'de> Visitor<'de> for SceneVisitor {
    type Value = SceneChoice;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("the name of a scene or an object")
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<SceneChoice, E> {
        Ok(SceneChoice::Name(name.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<SceneChoice, A::Error> {
        SceneSpec::deserialize(MapAccessDeserializer::new(map)).map(|spec| SceneChoice::Inline(Box::new(spec)))
    }
}

impl<'de> Deserialize<'de> for SceneChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SceneVisitor)
    }
}

struct TipVisitor;

impl<'de> Visitor<'de> for TipVisitor {
    type Value = TipSpec;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("the name of a tip or an object")
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<TipSpec, E> {
        TipName::deserialize(StrDeserializer::new(name)).map(TipSpec::Name)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TipSpec, A::Error> {
        TipShape::deserialize(MapAccessDeserializer::new(map)).map(TipSpec::Shape)
    }
}

impl<'de> Deserialize<'de> for TipSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TipVisitor)
    }
}

struct EffectsVisitor;

impl<'de> Visitor<'de> for EffectsVisitor {
    type Value = EffectsSpec;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("`auto`, `all` or an array of names")
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<EffectsSpec, E> {
        Ok(EffectsSpec::Word(word.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, names: A) -> Result<EffectsSpec, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(names)).map(EffectsSpec::Names)
    }
}

impl<'de> Deserialize<'de> for EffectsSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(EffectsVisitor)
    }
}

struct RetinaVisitor;

impl<'de> Visitor<'de> for RetinaVisitor {
    type Value = RetinaSpec;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a layer as an object or an array of them")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RetinaSpec, A::Error> {
        LayerSpec::deserialize(MapAccessDeserializer::new(map)).map(RetinaSpec::Whole)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, layers: A) -> Result<RetinaSpec, A::Error> {
        let layers = Vec::<Object<LayerSpec>>::deserialize(SeqAccessDeserializer::new(layers))?;
        Ok(RetinaSpec::Sublayers(layers.into_iter().map(|layer| layer.0).collect()))
    }
}

impl<'de> Deserialize<'de> for RetinaSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RetinaVisitor)
    }
}
