"""The agriculture mission's world: a corn field with weed and disease patches."""
