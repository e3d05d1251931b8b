"""What readers of logs and motion capture share: options, bodies with poses, tables of text, the list of formats."""
