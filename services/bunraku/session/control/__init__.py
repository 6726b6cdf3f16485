"""Control of a stage by its puppeteers and its crowd: bonds, open limbs and props."""
