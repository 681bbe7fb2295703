//! What a figure shows: an archetype, its experiment, and what of it.

use crate::svg::Colour;
use serde::Deserialize;

/// A figure to be drawn.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Spec {
    /// As the paper calls it
    pub name: String,
    /// What it shows
    pub title: String,
    /// What stands above the picture; the title where empty
    #[serde(default)]
    pub heading: String,
    /// The archetype that it is drawn by
    pub kind: Option<Archetype>,
    /// The registered drawing, where no archetype covers it
    #[serde(default)]
    pub drawing: String,
    /// Of which experiment
    pub experiment: String,
    /// Whose estimates, the first at the bottom
    #[serde(default)]
    pub estimators: Vec<Subject>,
    /// What stands above the one panel
    #[serde(default)]
    pub panel: String,
    /// Of which components: a panel each; all where empty
    #[serde(default)]
    pub components: Vec<String>,
    /// What is drawn over the steps, for `curves`
    #[serde(default)]
    pub quantity: Quantity,
    /// The unit of a radius, where the components have several
    #[serde(default)]
    pub unit: String,
    /// Every how many steps a curve has a point
    #[serde(default = "one")]
    pub every: i32,
    /// The time of a step in s; over steps where there is none
    pub period: Option<f64>,
    /// At which steps, for `sets-by-step`
    #[serde(default)]
    pub steps: Vec<i32>,
    /// From which step to which; the whole run where there is none
    pub window: Option<[i32; 2]>,
    /// Whether the axis upwards is logarithmic
    #[serde(default)]
    pub log: bool,
    /// What is to be seen, in Markdown, with `{names}` of what was measured; by the archetype where empty
    #[serde(default)]
    pub caption: String,
}

fn one() -> i32 {
    1
}

/// How a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Archetype {
    /// The true state, estimates and their enclosures over the steps, a panel a component
    Tube,
    /// A quantity over the steps, a curve an estimator
    Curves,
    /// Sets in the plane of two components, a panel a step
    SetsByStep,
    /// Scores with their intervals, a bar an estimator
    Bars,
}

/// What a curve shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Half the longest edge of the hull, over all components
    #[default]
    Radius,
    /// Half the edge of the hull, of each component
    HalfWidth,
    /// |estimate − truth|, of each component
    Error,
}

/// An estimator of a figure.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Subject {
    /// Its name in the experiment's file
    pub estimator: String,
    /// Its name in the legend
    pub label: String,
    /// `predicted` or `updated`
    pub phase: String,
    /// Its colour
    pub colour: Colour,
    /// Whether its curve is dashed
    #[serde(default)]
    pub dashed: bool,
    /// The experiment that it is from, where that is another one
    pub experiment: Option<String>,
}
