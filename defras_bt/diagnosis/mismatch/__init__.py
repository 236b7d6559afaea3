"""Who is to blame for a mismatch during an operation: asked before attachments are changed."""
