//! Random numbers that stay the same for ever: a study that is resumed years later, by a later version and on
//! another machine, continues in the order in which it began.
//!
//! A stream is ChaCha with 8 rounds. Its key is four words, little-endian: the study's seed, the subject's number,
//! what the stream is for, and the item that it is for. No stream depends on how much was drawn from another.

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};

/// What a stream is for; its number is part of the key.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
pub enum Purpose {
    /// The order of blocks and levels.
    Order = 1,
    /// Which interval has the comparison.
    Interval = 2,
    /// The noise of a simulated operator.
    Noise = 4,
}

/// A stream of random numbers.
#[derive(Debug)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// The stream of a study's seed for a subject, a purpose and an item.
    #[must_use]
    pub fn new(seed: u64, subject: u32, purpose: Purpose, item: u64) -> Self {
        let mut key = [0; 32];
        let words = [seed, u64::from(subject), purpose as u64, item];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Self(ChaCha8Rng::from_seed(key))
    }

    /// A number below `limit` (> 0), each as likely: the first 64-bit number below the largest multiple of it.
    pub fn below(&mut self, limit: u64) -> u64 {
        let end = u64::MAX - u64::MAX % limit;
        loop {
            let number = self.0.next_u64();
            if number < end {
                return number % limit;
            }
        }
    }

    /// From 0 (included) to 1 (excluded), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal, as the sum of twelve uniform numbers less 6: within 6, and the same on every machine, since it
    /// needs no elementary function.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Puts things in random order: from the last place down, each is swapped with a random one up to it.
    pub fn shuffle<T>(&mut self, things: &mut [T]) {
        for last in (1..things.len()).rev() {
            let other = self.below(last as u64 + 1) as usize;
            things.swap(last, other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_stays_the_same_for_ever() {
        let mut order: Vec<u8> = (1..=9).collect();
        Random::new(1, 2, Purpose::Order, 3).shuffle(&mut order);
        assert_eq!(order, ORDER);
        let mut other: Vec<u8> = (1..=9).collect();
        Random::new(1, 3, Purpose::Order, 3).shuffle(&mut other);
        assert_ne!(other, ORDER);
    }

    /// Drawn on x86-64 with chacha20 0.10.2.
    const ORDER: [u8; 9] = [1, 2, 7, 8, 9, 5, 4, 3, 6];

    #[test]
    fn normal_numbers_have_mean_0_and_deviation_1() {
        let mut random = Random::new(7, 0, Purpose::Noise, 0);
        let draws: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let mean = draws.iter().sum::<f64>() / 20_000.0;
        let variance = draws.iter().map(|draw| (draw - mean).powi(2)).sum::<f64>() / 20_000.0;
        // Four standard errors.
        assert!(mean.abs() < 4.0 / 20_000_f64.sqrt(), "{mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / 20_000_f64).sqrt(), "{variance}");
    }
}
