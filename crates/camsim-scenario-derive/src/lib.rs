//! `#[derive(Table)]` and `#[derive(Words)]`: the facts of a scenario's keys, from the fields that hold them.
//!
//! `camsim_scenario::keys` describes what they make.

use proc_macro::TokenStream;

mod attributes;
mod table;
mod words;

/// Implements `Table`, `Value` and `Default` for a struct whose fields are keys.
///
/// `#[key(...)]` on a field states, each where it applies: `required`, `default = EXPRESSION`, `unit = "px"`,
/// `step = 0.5` (change per point of drag), `min` or `above` and `max` or `below` (legal interval of every number
/// in it), `within = 360.0` (as `min = -360.0, max = 360.0`), `only = [8, 10]` (the legal numbers, in ascending
/// order), `hint = "..."` (advice where a number is outside), `example = "..."` (TOML, where the key is absent by
/// default) and `names = "fx fy"` (of the elements of a list). The doc comment is the description. Fields with
/// `#[serde(skip)]` are no keys.
#[proc_macro_derive(Table, attributes(key, serde))]
pub fn table(input: TokenStream) -> TokenStream {
    expand(input, table::expand)
}

/// Implements `Value` for an enum of unit variants, and gives it `ALL`, `NAMES` and `name`. Names are those of
/// serde; doc comments are the descriptions.
#[proc_macro_derive(Words, attributes(serde))]
pub fn words(input: TokenStream) -> TokenStream {
    expand(input, words::expand)
}

fn expand(
    input: TokenStream,
    by: fn(syn::DeriveInput) -> syn::Result<proc_macro2::TokenStream>,
) -> TokenStream {
    syn::parse(input).and_then(by).unwrap_or_else(|error| error.to_compile_error()).into()
}
