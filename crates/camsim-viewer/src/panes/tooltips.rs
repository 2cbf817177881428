//! Tooltips, placed beside the pane or line of their control, so that they cover neither it nor its
//! neighbours.

use eframe::egui::{
    Context, Id, LayerId, Popup, Rangef, Rect, RectAlign, Response, Tooltip, Ui, WidgetText, accesskit,
};

/// Rest of the pointer before a tooltip appears, seconds.
const DELAY_S: f32 = 0.7;
/// Width of tooltips, points, at most.
const MAX_WIDTH: f32 = 340.0;

/// Placement of the tooltips of controls that are drawn next. Menus and prompts over the window have egui's
/// own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TooltipPlacement {
    /// Below lines of controls with this range of heights.
    Below(Rangef),
    /// Above such lines.
    Above(Rangef),
    /// To the right of a pane with this horizontal range.
    Right(Rangef),
    /// To the left of such a pane.
    Left(Rangef),
}

impl TooltipPlacement {
    /// Sets the placement until another is set.
    pub fn set(self, context: &Context) {
        context.data_mut(|data| data.insert_temp(Id::unique("placement of tooltips"), self));
    }

    fn for_response(response: &Response) -> Option<Self> {
        let is_window = response.layer_id == LayerId::background();
        is_window
            .then(|| response.ctx.data(|data| data.get_temp(Id::unique("placement of tooltips"))))
            .flatten()
    }

    fn place<'a>(self, popup: Popup<'a>, control: Rect) -> Popup<'a> {
        // The range of the last pass, extended to the control.
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

/// Sets delay and width of tooltips, once for the window.
pub fn configure(context: &Context) {
    context.all_styles_mut(|style| {
        style.interaction.tooltip_delay = DELAY_S;
        // The delay also applies right after another tooltip.
        style.interaction.tooltip_grace_time = 0.0;
        style.spacing.tooltip_width = MAX_WIDTH;
    });
}

/// Controls that can have a tooltip.
pub trait WithTooltip {
    /// Adds a text, which is also the description for assistive technology.
    fn with_tooltip(self, text: impl Into<WidgetText>) -> Self;
    /// Adds a tooltip with the given content.
    fn with_tooltip_ui(self, draw: impl FnOnce(&mut Ui)) -> Self;
}

impl WithTooltip for Response {
    fn with_tooltip(self, text: impl Into<WidgetText>) -> Self {
        let text = text.into();
        describe(&self, text.text());
        self.with_tooltip_ui(|ui| {
            ui.set_max_width(ui.spacing().tooltip_width);
            ui.label(text);
        })
    }

    fn with_tooltip_ui(self, draw: impl FnOnce(&mut Ui)) -> Self {
        let mut tooltip = Tooltip::for_enabled(&self);
        if let Some(placement) = TooltipPlacement::for_response(&self) {
            tooltip.popup = placement.place(tooltip.popup, self.rect);
        }
        tooltip.show(draw);
        self
    }
}

/// Sets the description of a response's accessibility node, if it has one.
fn describe(response: &Response, text: &str) {
    if response.ctx.has_accesskit_node(response.id) {
        response.ctx.accesskit_node_builder(response.id, |node| {
            if node.description().is_none() {
                node.set_description(text);
            }
            // The name of a label is its text.
            if node.role() != accesskit::Role::Label
                && node.labelled_by().is_empty()
                && node.label().is_none_or(str::is_empty)
            {
                node.set_label(text);
            }
        });
    }
}
