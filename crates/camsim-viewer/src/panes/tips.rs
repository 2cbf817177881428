//! Explanations of controls. They come when the hand rests, and beside the pane or the line that a control is
//! in: neither it nor its neighbours are covered.

use eframe::egui::{
    Context, Id, LayerId, Popup, Rangef, Rect, RectAlign, Response, Tooltip, Ui, WidgetText, accesskit,
};

/// Rest of the hand before an explanation comes, seconds.
const DELAY_S: f32 = 0.7;
/// Points that explanations are wide, at most.
const WIDTH: f32 = 340.0;

/// Where explanations go of what is drawn from here on in the window itself. What lies over it, as menus and
/// questions do, has its own below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aside {
    /// Below lines of controls that reach from the first to the second height.
    Below(Rangef),
    /// Above such lines.
    Above(Rangef),
    /// On the right of a pane that reaches over this width.
    Right(Rangef),
    /// On its left.
    Left(Rangef),
}

impl Aside {
    /// For all that is drawn until another is set.
    pub fn set(self, context: &Context) {
        context.data_mut(|data| data.insert_temp(Id::unique("where explanations go"), self));
    }

    fn of(response: &Response) -> Option<Self> {
        let is_window = response.layer_id == LayerId::background();
        is_window
            .then(|| response.ctx.data(|data| data.get_temp(Id::unique("where explanations go"))))
            .flatten()
    }

    fn place<'a>(self, popup: Popup<'a>, control: Rect) -> Popup<'a> {
        // A line that is not yet as high as it will be still has the control in it.
        let hull = |range: Rangef, own: Rangef| Rangef::new(range.min.min(own.min), range.max.max(own.max));
        let (anchor, align) = match self {
            Self::Below(y) => (
                Rect::from_x_y_ranges(control.x_range(), hull(y, control.y_range())),
                RectAlign::BOTTOM_START,
            ),
            Self::Above(y) => {
                (Rect::from_x_y_ranges(control.x_range(), hull(y, control.y_range())), RectAlign::TOP_START)
            }
            Self::Right(x) => {
                (Rect::from_x_y_ranges(hull(x, control.x_range()), control.y_range()), RectAlign::RIGHT_START)
            }
            Self::Left(x) => {
                (Rect::from_x_y_ranges(hull(x, control.x_range()), control.y_range()), RectAlign::LEFT_START)
            }
        };
        popup.anchor(anchor).align(align)
    }
}

/// Sets how long a hand must rest, once for the window.
pub fn unhurried(context: &Context) {
    context.all_styles_mut(|style| {
        style.interaction.tooltip_delay = DELAY_S;
        // Nor does the next one come at once where a hand only passes.
        style.interaction.tooltip_grace_time = 0.0;
        style.spacing.tooltip_width = WIDTH;
    });
}

/// Controls that can be explained.
pub trait Explained {
    /// By words, which assistive technology is given, too.
    fn explained(self, text: impl Into<WidgetText>) -> Self;
    /// By whatever is drawn.
    fn explained_by(self, draw: impl FnOnce(&mut Ui)) -> Self;
}

impl Explained for Response {
    fn explained(self, text: impl Into<WidgetText>) -> Self {
        let text = text.into();
        describe(&self, text.text());
        self.explained_by(|ui| {
            ui.set_max_width(ui.spacing().tooltip_width);
            ui.label(text);
        })
    }

    fn explained_by(self, draw: impl FnOnce(&mut Ui)) -> Self {
        let mut tooltip = Tooltip::for_enabled(&self);
        if let Some(aside) = Aside::of(&self) {
            tooltip.popup = aside.place(tooltip.popup, self.rect);
        }
        tooltip.show(draw);
        self
    }
}

/// What is only hovered has no node of its own, and is given none.
fn describe(response: &Response, text: &str) {
    if response.ctx.has_accesskit_node(response.id) {
        response.ctx.accesskit_node_builder(response.id, |node| {
            if node.description().is_none() {
                node.set_description(text);
            }
            // A label is named by what it says.
            if node.role() != accesskit::Role::Label
                && node.labelled_by().is_empty()
                && node.label().is_none_or(str::is_empty)
            {
                node.set_label(text);
            }
        });
    }
}
