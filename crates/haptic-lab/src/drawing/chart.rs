//! What a chart holds: its traces and its axes, in the units of the quantities.

/// How a trace is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A line through the points; a point that is not finite interrupts it.
    Line,
    /// The same, dashed.
    Dashed,
    /// The same, thin and faint: a moment.
    Mark,
    /// A dot for each point.
    Dots,
    /// A disc for each point, whose area grows with the number of observations, and its bar.
    Discs,
}

/// A point that stands for observations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Across and up, in the units of the axes.
    pub at: [f64; 2],
    /// Ends of its error bar, in the unit of the vertical axis; none where they are not known.
    pub bar: Option<[f64; 2]>,
    /// Number of observations.
    pub count: u32,
}

/// Points under one name and in one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Name in the legend; one without a name is not in it.
    pub name: String,
    /// Points, across and up, in the units of the axes.
    pub points: Vec<[f64; 2]>,
    /// Number of observations of each point of [`Form::Discs`].
    pub counts: Vec<u32>,
    /// Error bar of each point of [`Form::Discs`], in the unit of the vertical axis.
    pub bars: Vec<Option<[f64; 2]>>,
    /// Name of each point, to the right of the plot with a line to the point; empty where they have none.
    pub labels: Vec<String>,
    /// How they are drawn.
    pub form: Form,
    /// Colour, counted from 0; that of its place among the traces where absent.
    pub colour: Option<usize>,
}

impl Trace {
    /// A line.
    #[must_use]
    pub fn line(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Form::Line)
    }

    /// A dashed line.
    #[must_use]
    pub fn dashed(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Form::Dashed)
    }

    /// Dots.
    #[must_use]
    pub fn dots(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Form::Dots)
    }

    /// Discs with error bars.
    #[must_use]
    pub fn discs(name: impl Into<String>, observations: &[Observation]) -> Self {
        let points = observations.iter().map(|one| one.at).collect();
        Self {
            counts: observations.iter().map(|one| one.count).collect(),
            bars: observations.iter().map(|one| one.bar).collect(),
            ..Self::new(name, points, Form::Discs)
        }
    }

    /// Points in a form, in the colour of their place among the traces.
    #[must_use]
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>, form: Form) -> Self {
        let name = name.into();
        Self {
            name,
            points,
            counts: Vec::new(),
            bars: Vec::new(),
            labels: Vec::new(),
            form,
            colour: None,
        }
    }

    /// The same in a colour of another trace's: what belongs together looks alike.
    #[must_use]
    pub const fn in_colour(mut self, colour: usize) -> Self {
        self.colour = Some(colour);
        self
    }
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity and unit, as in `Force (N)`.
    pub label: String,
    /// What it spans; the extent of the points where absent.
    pub range: Option<(f64, f64)>,
}

/// A chart: traces over one another. Later ones are above, and each has the colour of its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Title, above the chart.
    pub title: String,
    /// Horizontal axis.
    pub across: Axis,
    /// Vertical axis.
    pub up: Axis,
    /// Traces.
    pub traces: Vec<Trace>,
    /// Whether both axes are logarithmic; ranges and points are the values themselves.
    pub is_logarithmic: bool,
    /// Remarks above the plot: what it does not show, and why.
    pub notes: Vec<String>,
    /// Height of the plot itself, px.
    pub height_px: f64,
}

impl Chart {
    /// A chart without traces, 300 px high.
    #[must_use]
    pub fn new(title: impl Into<String>, across: impl Into<String>, up: impl Into<String>) -> Self {
        let axis = |label| Axis { label, range: None };
        Self {
            title: title.into(),
            across: axis(across.into()),
            up: axis(up.into()),
            traces: Vec::new(),
            is_logarithmic: false,
            notes: Vec::new(),
            height_px: 300.0,
        }
    }

    /// With one more trace.
    #[must_use]
    pub fn with(mut self, trace: Trace) -> Self {
        self.traces.push(trace);
        self
    }
}
