//! How far an identification is, for a caller that waits for it and may cancel it.

use super::error::IdentifyError;
use std::ops::ControlFlow;

/// Reports the share that is done, from 0 to 1, over a part of the whole.
pub(super) struct Progress<'a> {
    report: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    from: f64,
    to: f64,
}

impl<'a> Progress<'a> {
    /// Of the whole identification.
    pub(super) fn new(report: &'a mut dyn FnMut(f64) -> ControlFlow<()>) -> Self {
        Self {
            report,
            from: 0.0,
            to: 1.0,
        }
    }

    /// Reports a share of this part.
    ///
    /// # Errors
    /// The caller cancels.
    pub(super) fn at(&mut self, share: f64) -> Result<(), IdentifyError> {
        match (self.report)(self.from + share * (self.to - self.from)) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(IdentifyError::Cancelled),
        }
    }

    /// The part of this one between two shares.
    pub(super) fn part(&mut self, from: f64, to: f64) -> Progress<'_> {
        let length = self.to - self.from;
        Progress {
            from: self.from + from * length,
            to: self.from + to * length,
            report: &mut *self.report,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_one_another_and_a_caller_cancels() {
        let mut shares = Vec::new();
        let mut report = |share: f64| {
            shares.push(share);
            if share < 0.7 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        };
        let mut whole = Progress::new(&mut report);
        let mut second = whole.part(0.5, 1.0);
        assert!(second.at(0.0).is_ok());
        assert!(matches!(second.part(0.0, 0.5).at(1.0), Err(IdentifyError::Cancelled)));
        assert_eq!(shares, [0.5, 0.75]);
    }
}
