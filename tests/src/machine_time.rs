//! What the machine was busy with, as Linux tells it: this process, other programs, and the hypervisor.

/// What Linux counts processor time in.
const TICKS_PER_SECOND: f64 = 100.0;

/// Processor time of the whole machine, in all since it began (s), where Linux tells it.
#[derive(Clone, Copy, Debug)]
pub struct MachineTime {
    busy_s: f64,
    stolen_s: f64,
    all_s: f64,
}

impl MachineTime {
    /// Since the machine began; `None` where nothing tells it.
    pub fn now() -> Option<Self> {
        let text = std::fs::read_to_string("/proc/stat").ok()?;
        let line = text.lines().next()?.split_whitespace().skip(1).take(8);
        let ticks: Vec<f64> = line.map(str::parse).collect::<Result<_, _>>().ok()?;
        let &[user, nice, system, idle, waiting, interrupts, soft, stolen] = ticks.as_slice() else { return None };
        let busy = user + nice + system + interrupts + soft;
        let all = busy + idle + waiting + stolen;
        let [busy_s, stolen_s, all_s] = [busy, stolen, all].map(|ticks| ticks / TICKS_PER_SECOND);
        Some(Self { busy_s, stolen_s, all_s })
    }

    /// Shares of the time since `before` that other programs had, and that the hypervisor gave to others, where this process had `own_s`.
    pub fn shares_since(&self, before: &Self, own_s: f64) -> (f64, f64) {
        let all_s = self.all_s - before.all_s;
        let others_s = (self.busy_s - before.busy_s - own_s).max(0.0);
        (others_s / all_s, (self.stolen_s - before.stolen_s) / all_s)
    }
}

/// Processor time that this process has used (s), where Linux tells it, in hundredths of a second: what an answer costs whatever else runs on the machine.
pub fn cpu_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in parentheses, may have spaces; user and system time are the 12th and 13th number after it.
    let mut numbers = text.rsplit(')').next()?.split_whitespace().skip(11).map(str::parse::<f64>);
    Some((numbers.next()?.ok()? + numbers.next()?.ok()?) / TICKS_PER_SECOND)
}
