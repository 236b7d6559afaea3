"""Named physical causes by which reality differs from the plain model, one file each."""
