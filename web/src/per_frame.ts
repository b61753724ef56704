/** Work that is only worth doing for what will be seen. */

/** However often the result is called, `work` runs once before the next frame. */
export function perFrame(work: () => void): () => void {
  let pending = false;
  return () => {
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      work();
    });
  };
}
