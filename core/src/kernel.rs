//! Loops that run under the machine's widest vector instructions: the one place that asks which these are.
//!
//! Not here: what is computed. Products that name vectors themselves are in `network::packed` and `solve::columns`.

/// A computation in loops that the compiler makes vector instructions of. A trait and not a closure: a closure that is not inlined loses them.
pub trait Kernel {
    /// What it returns.
    type Output;

    /// Runs it. Implementations and all that they call are `#[inline(always)]`.
    fn run(self) -> Self::Output;
}

struct Dispatched<K>(K);

impl<K: Kernel> pulp::WithSimd for Dispatched<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) -> K::Output {
        self.0.run()
    }
}

/// Runs `kernel` under the machine's widest vector instructions.
pub fn run_kernel<K: Kernel>(kernel: K) -> K::Output {
    pulp::Arch::new().dispatch(Dispatched(kernel))
}
