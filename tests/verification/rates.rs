//! Effects of rate against closed forms: the relaxation curve of a Prony series, its instantaneous and its lasting limit, the loss of a cycle, the
//! period of a free vibration.

mod relaxation;
mod vibration;
