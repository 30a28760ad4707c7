//! In which order a subject does things: random, counterbalanced by a Latin square, or as a file says.

use super::random::{Purpose, Random};
use super::subject::Subject;
use serde::{Deserialize, Serialize};

/// How the order of a subject comes about, unless the subject has one of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// From the seed and the subject's number.
    #[default]
    Random,
    /// A row of a Latin square, by the subject's number.
    LatinSquare,
}

/// The things, by their places in the plan, in the order in which a subject does them.
pub(crate) fn places(order: Order, names: &[String], seed: u64, subject: &Subject) -> Vec<usize> {
    let mut places: Vec<usize> = (0..names.len()).collect();
    match order {
        _ if !subject.order.is_empty() => {
            let place = |name: &String| subject.order.iter().position(|given| given == name);
            places.sort_by_key(|index| place(&names[*index]));
            places
        }
        Order::Random => {
            Random::new(seed, subject.number, Purpose::Order, 0).shuffle(&mut places);
            places
        }
        Order::LatinSquare => row(names.len(), subject.number.saturating_sub(1) as usize),
    }
}

/// Rows of the square of so many things: a number of subjects is balanced where it is a multiple of this.
#[must_use]
pub const fn rows(count: usize) -> usize {
    if count.is_multiple_of(2) { count } else { 2 * count }
}

/// A row of the square of Williams (1949). In the square each thing is at each place, and directly after each other
/// thing, equally often; an odd number of things takes two squares, the second of them backwards.
fn row(count: usize, number: usize) -> Vec<usize> {
    let number = number % rows(count).max(1);
    let first = (0..count).map(|place| {
        if place % 2 == 1 {
            place.div_ceil(2)
        } else {
            count - place / 2
        }
    });
    let mut row: Vec<usize> = first.map(|thing| (thing + number) % count).collect();
    if number >= count {
        row.reverse();
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn a_latin_square_balances_places_and_neighbours() {
        for count in 1..=9 {
            let square: Vec<Vec<usize>> = (0..rows(count)).map(|number| row(count, number)).collect();
            let (mut at_places, mut neighbours) = (BTreeMap::new(), BTreeMap::new());
            for row in &square {
                for at in row.iter().enumerate() {
                    *at_places.entry(at).or_insert(0) += 1;
                }
                for pair in row.windows(2) {
                    *neighbours.entry((pair[0], pair[1])).or_insert(0) += 1;
                }
            }
            assert_eq!(at_places.len(), count * count, "{square:?}");
            assert!(
                at_places.values().all(|times| times * count == square.len()),
                "{square:?}"
            );
            assert_eq!(neighbours.len(), count * (count - 1), "{square:?}");
            assert!(
                neighbours.values().all(|times| times * count == square.len()),
                "{square:?}"
            );
            assert_eq!(row(count, rows(count)), square[0], "it begins again");
        }
    }
}
