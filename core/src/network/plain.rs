//! Products in plain loops: slow, and plainly right. Tests hold the fast path against them.

/// `x w + bias` for every row of `x`, `inner` numbers each.
pub fn affine(x: &[f32], w: &[f32], bias: &[f32], inner: usize) -> Vec<f32> {
    let columns = bias.len();
    let mut out = Vec::with_capacity(x.len() / inner * columns);
    for row in x.chunks_exact(inner) {
        for (column, bias) in bias.iter().enumerate() {
            let mut sum = *bias;
            for (k, number) in row.iter().enumerate() {
                sum += number * w[k * columns + column];
            }
            out.push(sum);
        }
    }
    out
}
