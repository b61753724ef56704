//! A look into a network's layers, for holding it against another program that computes the same.

/// Who is shown what each layer answers: its name, its number among those of that name, and its numbers row by row.
pub type Observer<'a> = &'a mut dyn FnMut(&str, usize, &[f32]);
