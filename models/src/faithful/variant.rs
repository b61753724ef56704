//! Variants of the paper's network for its ablation: another graph convolution, or a part of the features alone.
//!
//! A part that is left out is zero, so the number of parameters stays. Without positions all nodes of a body have the same numbers, and only the mesh
//! tells them apart.

use retina_core::network::faithful::features::RIGID;

use super::prepared::View;

/// The graph convolution of both encoders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backbone {
    /// TAGConv with K = 3, the paper's.
    Tag,
    /// GCN: `y = Â x W + b`, `Â` with loops (Kipf & Welling 2017).
    Gcn,
    /// GAT with one head (Veličković et al. 2018).
    Gat,
}

/// Which features the network is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Positions and force, as the paper does.
    Both,
    /// Positions of both bodies alone.
    Position,
    /// The force alone.
    Physics,
}

/// One row of the ablation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// See [`Backbone`].
    pub backbone: Backbone,
    /// See [`Seen`].
    pub seen: Seen,
}

/// Numbers of a tool's node that tell of the force: direction and magnitude, before the position's.
const FORCE: usize = 4;

impl Variant {
    /// The paper's own.
    pub const PAPER: Variant = Variant { backbone: Backbone::Tag, seen: Seen::Both };
    /// The rows of the ablation.
    pub const ALL: [Variant; 5] = [
        Variant::PAPER,
        Variant { backbone: Backbone::Tag, seen: Seen::Position },
        Variant { backbone: Backbone::Tag, seen: Seen::Physics },
        Variant { backbone: Backbone::Gcn, seen: Seen::Both },
        Variant { backbone: Backbone::Gat, seen: Seen::Both },
    ];

    /// Its name in folders and tables.
    pub fn name(&self) -> String {
        let backbone = match self.backbone {
            Backbone::Tag => "tag",
            Backbone::Gcn => "gcn",
            Backbone::Gat => "gat",
        };
        let seen = match self.seen {
            Seen::Both => "both",
            Seen::Position => "position",
            Seen::Physics => "physics",
        };
        format!("{backbone}-{seen}")
    }
}

impl Seen {
    /// Makes zero what is not told.
    pub fn hide(self, view: &mut View) {
        match self {
            Seen::Both => {}
            Seen::Position => view.rigid.chunks_exact_mut(RIGID).for_each(|node| node[..FORCE].fill(0.0)),
            Seen::Physics => {
                view.soft.fill(0.0);
                view.rigid.chunks_exact_mut(RIGID).for_each(|node| node[FORCE..].fill(0.0));
            }
        }
    }
}
