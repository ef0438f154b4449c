//! Images: film, EXR and PNG files, tone mapping, metrics.
