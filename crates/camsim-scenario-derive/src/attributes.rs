//! Doc comments and attributes.

use proc_macro2::TokenStream;
use quote::{ToTokens, quote};
use syn::{Attribute, Expr, ExprLit, Lit, LitStr, Meta, Result, meta::ParseNestedMeta, parse_quote};

/// The text of a doc comment, its lines joined; paragraphs after the first are skipped.
pub fn doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    });
    lines.take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Calls `visit` with each part of the attributes of a name, as in `#[serde(skip, rename = "a")]`.
pub fn visit_parts(
    attributes: &[Attribute],
    name: &str,
    mut visit: impl FnMut(&ParseNestedMeta<'_>) -> Result<()>,
) -> Result<()> {
    attributes
        .iter()
        .filter(|attribute| attribute.path().is_ident(name))
        .try_for_each(|attribute| attribute.parse_nested_meta(|part| visit(&part)))
}

/// The text of a part that may have one; parts without it, or of another type, are skipped.
fn text_of(part: &ParseNestedMeta<'_>) -> Result<Option<String>> {
    if !part.input.peek(syn::Token![=]) {
        return Ok(None);
    }
    let expression: Expr = part.value()?.parse()?;
    Ok(match expression {
        Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value()),
        _ => None,
    })
}

/// What serde does with a field or variant.
#[derive(Debug, Default)]
pub struct Serde {
    pub skip: bool,
    pub rename: Option<String>,
    pub rename_all: Option<String>,
}

impl Serde {
    pub fn of(attributes: &[Attribute]) -> Result<Self> {
        let mut serde = Self::default();
        visit_parts(attributes, "serde", |part| {
            let text = text_of(part)?;
            if part.path.is_ident("skip") {
                serde.skip = true;
            } else if part.path.is_ident("rename") {
                serde.rename = text;
            } else if part.path.is_ident("rename_all") {
                serde.rename_all = text;
            }
            Ok(())
        })?;
        Ok(serde)
    }
}

/// `#[key(...)]` of a field, as expressions.
pub struct Key {
    pub required: bool,
    pub default: Option<Expr>,
    pub unit: TokenStream,
    pub step: TokenStream,
    pub low: TokenStream,
    pub high: TokenStream,
    pub only: Vec<Expr>,
    pub hint: TokenStream,
    pub example: TokenStream,
    pub names: Vec<String>,
}

impl Key {
    pub fn of(attributes: &[Attribute]) -> Result<Self> {
        let none = || quote!("");
        let end = |kind: TokenStream, value: Expr| quote!(::camsim_scenario::keys::End::#kind(#value as f64));
        let mut key = Self {
            required: false,
            default: None,
            unit: none(),
            step: quote!(1.0),
            low: quote!(::camsim_scenario::keys::End::None),
            high: quote!(::camsim_scenario::keys::End::None),
            only: Vec::new(),
            hint: none(),
            example: none(),
            names: Vec::new(),
        };
        visit_parts(attributes, "key", |part| {
            let name = part.path.require_ident()?.to_string();
            if name == "required" {
                key.required = true;
                return Ok(());
            }
            let value: Expr = part.value()?.parse()?;
            match name.as_str() {
                "default" => key.default = Some(value),
                "unit" => key.unit = value.into_token_stream(),
                "step" => key.step = value.into_token_stream(),
                "min" => key.low = end(quote!(Closed), value),
                "above" => key.low = end(quote!(Open), value),
                "max" => key.high = end(quote!(Closed), value),
                "below" => key.high = end(quote!(Open), value),
                "within" => {
                    key.low = end(quote!(Closed), parse_quote!(-#value));
                    key.high = end(quote!(Closed), value);
                }
                "only" => {
                    let Expr::Array(list) = value else { return Err(part.error("`only` is a list")) };
                    key.only = list.elems.into_iter().collect();
                    let (Some(first), Some(last)) = (key.only.first().cloned(), key.only.last().cloned())
                    else {
                        return Err(part.error("`only` is empty"));
                    };
                    (key.low, key.high) = (end(quote!(Closed), first), end(quote!(Closed), last));
                }
                "hint" => key.hint = value.into_token_stream(),
                "example" => key.example = value.into_token_stream(),
                "names" => {
                    let names: LitStr = syn::parse2(value.into_token_stream())?;
                    key.names = names.value().split_whitespace().map(str::to_owned).collect();
                }
                _ => return Err(part.error("no part of `key`")),
            }
            Ok(())
        })?;
        Ok(key)
    }
}
