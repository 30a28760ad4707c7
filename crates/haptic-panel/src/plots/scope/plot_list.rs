//! The plots over time, from top to bottom: any signal in any plot.

use super::value_axis::ValueAxis;
use crate::tape::plane::Component;
use crate::tape::signal::{Quantity, Signal};

/// Most plots at once: more would be lower than their names.
const MAX_PLOTS: usize = 8;

/// A plot over time.
#[derive(Clone, Debug)]
pub(crate) struct Plot {
    /// It stays the same while plots come and go.
    pub(crate) id: u32,
    /// What it shows, in the order of [`Signal::ALL`].
    signals: Vec<Signal>,
    /// Of a rig of two axes, lengths instead of x and y.
    pub(crate) shows_lengths: bool,
    pub(crate) axis: ValueAxis,
}

impl Plot {
    pub(crate) fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Shows a signal or hides it.
    pub(crate) fn toggle(&mut self, signal: Signal) {
        match self.signals.iter().position(|shown| *shown == signal) {
            Some(place) => drop(self.signals.remove(place)),
            None => self.signals.push(signal),
        }
        self.signals.sort_by_key(|signal| signal.index());
    }

    /// The quantities that it shows, each once.
    fn quantities(&self) -> Vec<Quantity> {
        let of_plot = |quantity: &Quantity| self.signals.iter().any(|signal| signal.quantity() == *quantity);
        Quantity::ALL.into_iter().filter(of_plot).collect()
    }

    /// Names and units of its quantities, for its axis.
    pub(crate) fn label(&self) -> String {
        let quantities = self.quantities();
        let label = |quantity: &Quantity| format!("{} ({})", quantity.name(), quantity.unit());
        quantities.iter().map(label).collect::<Vec<_>>().join(", ")
    }

    /// The unit of its values; empty where they have several.
    pub(crate) fn unit(&self) -> &'static str {
        match self.quantities()[..] {
            [only] => only.unit(),
            _ => "",
        }
    }

    /// Smallest span of its axis while it is fitted.
    pub(crate) fn smallest_span(&self) -> f64 {
        let spans = self.quantities().into_iter().map(Quantity::smallest_span);
        spans.reduce(f64::min).unwrap_or(1.0)
    }
}

#[derive(Clone, Debug)]
pub(crate) struct PlotList {
    plots: Vec<Plot>,
    next_id: u32,
}

impl Default for PlotList {
    /// The force on the hand; position and velocity of block and device.
    fn default() -> Self {
        Self::of([
            vec![Signal::COMMAND_FORCE],
            Quantity::Position.signals().collect(),
            Quantity::Velocity.signals().collect(),
        ])
    }
}

impl PlotList {
    pub(crate) fn of(plots: impl IntoIterator<Item = Vec<Signal>>) -> Self {
        let mut list = Self {
            plots: Vec::new(),
            next_id: 0,
        };
        for signals in plots {
            list.add(signals);
        }
        list
    }

    /// Adds a plot below the others, unless there are many.
    pub(crate) fn add(&mut self, signals: impl IntoIterator<Item = Signal>) {
        if self.is_full() {
            return;
        }
        self.plots.push(Plot {
            id: self.next_id,
            signals: signals.into_iter().collect(),
            shows_lengths: false,
            axis: ValueAxis::default(),
        });
        self.next_id += 1;
    }

    /// Whether there is no room for another plot.
    pub(crate) fn is_full(&self) -> bool {
        self.plots.len() >= MAX_PLOTS
    }

    pub(crate) fn remove(&mut self, place: usize) {
        self.plots.remove(place);
    }

    /// Moves the plot at a place up by one.
    pub(crate) fn raise(&mut self, place: usize) {
        if let Some(above) = place.checked_sub(1) {
            self.plots.swap(above, place);
        }
    }

    pub(crate) fn plots(&self) -> &[Plot] {
        &self.plots
    }

    pub(crate) fn plots_mut(&mut self) -> &mut [Plot] {
        &mut self.plots
    }

    /// The name of the plot at a place: its first quantity, with a number where another one above it has
    /// the same.
    pub(crate) fn name(&self, place: usize) -> String {
        let first = |plot: &Plot| plot.quantities().first().map_or("Empty", |quantity| quantity.name());
        let name = first(&self.plots[place]);
        let same = self.plots[..place].iter().filter(|plot| first(plot) == name).count();
        match same {
            0 => name.to_owned(),
            above => format!("{name} {}", above + 1),
        }
    }

    /// Every line that is shown, each once; without a block none that is of one.
    pub(crate) fn lines(&self, has_block: bool, is_plane: bool) -> Vec<(Signal, Component)> {
        let mut lines = Vec::new();
        for signal in Signal::ALL.into_iter().filter(|signal| signal.is_there(has_block)) {
            for plot in self.plots.iter().filter(|plot| plot.signals.contains(&signal)) {
                for component in Component::of(signal, is_plane, plot.shows_lengths) {
                    if !lines.contains(&(signal, *component)) {
                        lines.push((signal, *component));
                    }
                }
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &PlotList) -> Vec<String> {
        (0..list.plots().len()).map(|place| list.name(place)).collect()
    }

    #[test]
    fn later_plot_lines_are_thinner_than_earlier_ones() {
        for plot in PlotList::default().plots() {
            let widths: Vec<f32> = plot.signals().iter().map(|signal| signal.width()).collect();
            assert!(widths.is_sorted_by(|under, over| under > over), "{widths:?}");
        }
    }

    #[test]
    fn plots_are_added_moved_and_removed_and_their_names_differ() {
        let mut list = PlotList::default();
        list.add(Quantity::Force.signals());
        list.add([]);
        assert_eq!(names(&list), ["Force", "Position", "Velocity", "Force 2", "Empty"]);
        list.raise(3);
        list.remove(0);
        assert_eq!(names(&list), ["Position", "Force", "Velocity", "Empty"]);
        list.raise(0);
        assert_eq!(names(&list)[0], "Position", "nothing is above it");
        let ids: std::collections::BTreeSet<u32> = list.plots().iter().map(|plot| plot.id).collect();
        assert_eq!(ids.len(), 4);
        for _ in 0..20 {
            list.add([]);
        }
        assert!(list.is_full() && list.plots().len() == MAX_PLOTS);
    }

    #[test]
    fn a_plot_of_two_quantities_names_both_units() {
        let mut list = PlotList::default();
        let plot = &mut list.plots_mut()[0];
        assert_eq!((plot.label().as_str(), plot.unit()), ("Force (N)", "N"));
        plot.toggle(Signal::BLOCK_VELOCITY);
        assert_eq!((plot.label().as_str(), plot.unit()), ("Force (N), Velocity (mm/s)", ""));
        plot.toggle(Signal::BLOCK_VELOCITY);
        plot.toggle(Signal::COMMAND_FORCE);
        assert_eq!(plot.signals(), []);
        plot.toggle(Signal::COMMAND_FORCE);
        plot.toggle(Signal::COUPLING_FORCE);
        assert_eq!(
            plot.signals(),
            [Signal::COUPLING_FORCE, Signal::COMMAND_FORCE],
            "in the order of drawing"
        );
    }
}
