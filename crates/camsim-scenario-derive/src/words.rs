//! `#[derive(Words)]`.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DataEnum, DeriveInput, Error, Result};

use crate::attributes::{Serde, doc};

pub fn expand(input: DeriveInput) -> Result<TokenStream> {
    let Data::Enum(DataEnum { variants, .. }) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "words are the variants of an enum"));
    };
    let (name, rule) = (&input.ident, Serde::of(&input.attrs)?.rename_all.unwrap_or_default());
    let (mut idents, mut words, mut descriptions) = (Vec::new(), Vec::new(), Vec::new());
    for variant in variants {
        let ident = &variant.ident;
        words.push(match Serde::of(&variant.attrs)?.rename {
            Some(word) => word,
            None => renamed(&ident.to_string(), &rule).ok_or_else(|| {
                Error::new_spanned(ident, "serde(rename_all) of kebab-case, snake_case or lowercase")
            })?,
        });
        idents.push(ident);
        descriptions.push(doc(&variant.attrs));
    }
    Ok(quote! {
        impl #name {
            /// All, in the order of the documentation.
            pub const ALL: &'static [Self] = &[#(Self::#idents),*];
            /// Their names.
            pub const NAMES: &'static [&'static str] = &[#(#words),*];

            /// The one of a name.
            #[must_use]
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|known| known.name() == name)
            }

            /// Name in a scenario.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    #(Self::#idents => #words),*
                }
            }
        }

        impl ::camsim_scenario::keys::Value for #name {
            const KIND: ::camsim_scenario::keys::ValueKind =
                ::camsim_scenario::keys::ValueKind::Word(&[#(#words),*]);
            const LIST: ::camsim_scenario::keys::ValueKind =
                ::camsim_scenario::keys::ValueKind::Words(&[#(#words),*]);
            const OR_AUTO: ::camsim_scenario::keys::ValueKind =
                ::camsim_scenario::keys::ValueKind::Word(&["auto", #(#words),*]);
            const WORDS: &'static [::camsim_scenario::keys::Word] = &[#(
                ::camsim_scenario::keys::Word { name: #words, about: #descriptions }
            ),*];

            fn leaf(&self) -> ::camsim_scenario::keys::Leaf<'_> {
                ::camsim_scenario::keys::Leaf::Text(self.name().into())
            }
        }
    })
}

/// A variant's name by a rule of serde.
fn renamed(variant: &str, rule: &str) -> Option<String> {
    let separator = match rule {
        "lowercase" => "",
        "kebab-case" => "-",
        "snake_case" => "_",
        _ => return None,
    };
    let mut name = String::new();
    for (index, letter) in variant.char_indices() {
        if letter.is_uppercase() && index > 0 {
            name += separator;
        }
        name.extend(letter.to_lowercase());
    }
    Some(name)
}
