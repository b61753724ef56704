//! How many scenes of one's own a service keeps, and how large.

use crate::problem::{Kind, Problem};

/// What bounds the stored scenes. Several services over one place each hold to their own.
#[derive(Clone, Copy, Debug)]
pub struct Quota {
    /// Scenes.
    pub scenes: usize,
    /// Bytes of one content.
    pub each: u64,
    /// Bytes of all contents.
    pub total: u64,
}

impl Quota {
    /// Whether one content may be as large.
    ///
    /// # Errors
    /// [`Kind::SceneTooLarge`].
    pub fn check_size(&self, bytes: u64) -> Result<(), Problem> {
        if bytes <= self.each {
            return Ok(());
        }
        let detail = format!("The scene takes {bytes} bytes with every number written out; {} are allowed.", self.each);
        Err(Problem::new(Kind::SceneTooLarge, detail))
    }

    /// Whether a content of so many bytes has room beside those that there are.
    ///
    /// # Errors
    /// [`Kind::StoreFull`].
    pub fn check_room(&self, bytes: u64, there: &[u64]) -> Result<(), Problem> {
        let (count, used) = (there.len(), there.iter().sum::<u64>());
        if count >= self.scenes {
            let detail = format!("There are {count} stored scenes, as many as are allowed; delete one first.");
            return Err(Problem::new(Kind::StoreFull, detail));
        }
        if used + bytes > self.total {
            let detail = format!(
                "The scene takes {bytes} bytes, and {} of {} are left; delete others first.",
                self.total.saturating_sub(used),
                self.total
            );
            return Err(Problem::new(Kind::StoreFull, detail));
        }
        Ok(())
    }
}
